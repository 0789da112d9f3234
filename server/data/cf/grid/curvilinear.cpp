// Identifies x and y by the mean changes of longitude and latitude along two dimensions, and stores
// the values in the order of volumes.
#include "server/data/cf/grid/curvilinear.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <sstream>
#include <string>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/coordinates.hpp"

namespace windsplat::data::cf {

namespace {

constexpr std::size_t samples_read = std::size_t{1} << 24;

struct Change {
  double slow = 0;  // sum of the differences along the slower dimension of the file
  double fast = 0;
};

// Longitude differences take the shorter way around the globe.
double difference(double a, double b, bool is_longitude) {
  return is_longitude ? std::remainder(b - a, 360.0) : b - a;
}

Change change_of(const std::vector<double>& values, std::size_t rows, std::size_t columns,
                 bool is_longitude) {
  Change sum;
  const auto add = [&](double& total, std::size_t from, std::size_t to) {
    const double step = difference(values[from], values[to], is_longitude);
    total += std::isfinite(step) ? step : 0;
  };
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      if (r + 1 < rows) {
        add(sum.slow, r * columns + c, (r + 1) * columns + c);
      }
      if (c + 1 < columns) {
        add(sum.fast, r * columns + c, r * columns + c + 1);
      }
    }
  }
  // Per step, so that a long dimension does not outweigh a short one.
  sum.slow /= static_cast<double>(std::max<std::size_t>(1, (rows - 1) * columns));
  sum.fast /= static_cast<double>(std::max<std::size_t>(1, rows * (columns - 1)));
  return sum;
}

// Requires is_position(variable).
bool is_longitude(const FileVariable& variable) {
  const std::string name = lower(variable.standard_name);
  return name == "longitude" || (name != "latitude" && is_east(lower(variable.units)));
}

// 2-D values in the order of the file, slower dimension first.
struct Table {
  std::vector<double> values;
  int slow = -1;  // dimension ids
  std::size_t columns = 0;
};

// Reorders to that of volumes: x fastest, west to east, south to north. In place unless rows and
// columns are exchanged.
std::vector<double> in_order(Table table, int x, std::array<std::size_t, 2> lengths,
                             const std::array<bool, 2>& turned) {
  const std::size_t width = lengths[0];
  const std::size_t height = lengths[1];
  std::vector<double> out = std::move(table.values);
  if (table.slow == x) {
    const std::vector<double> by_columns = std::exchange(out, std::vector<double>(out.size()));
    for (std::size_t n = 0; n < out.size(); ++n) {
      out[n] = by_columns[n % width * table.columns + n / width];
    }
  }
  const auto row = [&](std::size_t j) { return out.data() + j * width; };
  for (std::size_t j = 0; turned[1] && j < height / 2; ++j) {
    std::swap_ranges(row(j), row(j + 1), row(height - 1 - j));
  }
  for (std::size_t j = 0; turned[0] && j < height; ++j) std::reverse(row(j), row(j + 1));
  return out;
}

// Idealised cases of WRF repeat one place, mostly 0, 0.
bool is_one_place(const std::vector<double>& values) {
  return values.size() > 1 && std::all_of(values.begin(), values.end(),
                                          [&](double value) { return value == values.front(); });
}

// Returns null if a longitude or latitude is missing, or all are the same.
std::shared_ptr<const Columns> columns_of(std::array<Table, 2> tables, int x,
                                          std::array<std::size_t, 2> lengths,
                                          const std::array<bool, 2>& turned) {
  auto columns = std::make_shared<Columns>();
  columns->longitude = in_order(std::move(tables[0]), x, lengths, turned);
  columns->latitude = in_order(std::move(tables[1]), x, lengths, turned);
  const auto finite = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  };
  if (!finite(columns->longitude) || !finite(columns->latitude)) return nullptr;
  if (is_one_place(columns->longitude) || is_one_place(columns->latitude)) return nullptr;
  unwrap_longitudes(columns->longitude, lengths[0]);
  return columns;
}

}  // namespace

void unwrap_longitudes(std::vector<double>& longitude, std::size_t width) {
  const auto follow = [&](std::size_t from, std::size_t to) {
    longitude[to] = longitude[from] + difference(longitude[from], longitude[to], true);
  };
  for (std::size_t n = width; n < longitude.size(); n += width) follow(n - width, n);
  for (std::size_t n = 0; n < longitude.size(); ++n) {
    if (n % width != 0) follow(n - 1, n);
  }
}

int position_on(const FileContents& contents, int a, int b, bool longitude) {
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& variable = contents.variables[v];
    const bool fits =
        variable.dims == std::vector<int>{a, b} || variable.dims == std::vector<int>{b, a};
    if (fits && variable.numeric && is_position(variable) && is_longitude(variable) == longitude) {
      return static_cast<int>(v);
    }
  }
  return -1;
}

Result<Bearing> find_bearing(const ArrayFile& file, const std::vector<DimensionRole>& roles,
                             GridChoice& choice) {
  const FileContents& contents = file.contents();
  const int x = choice.space[0];
  const int y = choice.space[1];
  Bearing bearing;
  if (x < 0 || y < 0 || roles.at(static_cast<std::size_t>(x)).coordinate >= 0 ||
      roles.at(static_cast<std::size_t>(y)).coordinate >= 0) {
    return bearing;
  }
  std::array<Table, 2> tables;        // values of longitude and latitude
  std::array<Change, 2> along_x_y{};  // changes of longitude and latitude: fast is along x, slow
                                      // along y
  for (const bool longitude : {true, false}) {
    const int v = position_on(contents, x, y, longitude);
    if (v < 0) {
      return bearing;
    }
    const auto& dims = contents.variables[static_cast<std::size_t>(v)].dims;
    const std::size_t rows = contents.dimensions[static_cast<std::size_t>(dims[0])].length;
    const std::size_t columns = contents.dimensions[static_cast<std::size_t>(dims[1])].length;
    if (rows == 0 || columns == 0 || rows > samples_read / columns) {
      return bearing;
    }
    auto values = unpacked_degrees(file, v);
    if (!values) {
      return values.error();
    }
    if (is_one_place(*values)) return bearing;
    Change change = change_of(*values, rows, columns, longitude);
    if (dims[0] == x) {
      std::swap(change.slow, change.fast);
    }
    along_x_y.at(longitude ? 0 : 1) = change;
    tables.at(longitude ? 0 : 1) = {std::move(*values), dims[0], columns};
  }
  bearing.is_curvilinear = true;
  const bool swapped = bearing.swapped =
      std::abs(along_x_y[0].slow) > std::abs(along_x_y[0].fast) &&
      std::abs(along_x_y[1].fast) > std::abs(along_x_y[1].slow);
  if (swapped) {
    std::swap(choice.space[0], choice.space[1]);
  }
  bearing.turned = {(swapped ? along_x_y[0].slow : along_x_y[0].fast) < 0,
                    (swapped ? along_x_y[1].fast : along_x_y[1].slow) < 0};
  const auto length = [&](std::size_t axis) {
    return contents.dimensions[static_cast<std::size_t>(choice.space.at(axis))].length;
  };
  bearing.columns =
      columns_of(std::move(tables), choice.space[0], {length(0), length(1)}, bearing.turned);
  return bearing;
}

Result<std::shared_ptr<const Columns>> find_columns(const ArrayFile& file, const Placement& grid) {
  const FileContents& contents = file.contents();
  if (grid.space[0] < 0 || grid.space[1] < 0) return nullptr;
  std::array<Table, 2> tables;
  for (const bool longitude : {true, false}) {
    const int v = position_on(contents, grid.space[0], grid.space[1], longitude);
    if (v < 0 || grid.length[0] > samples_read / grid.length[1]) return nullptr;
    auto values = unpacked_degrees(file, v);
    if (!values) return values.error();
    const auto& dims = contents.variables[static_cast<std::size_t>(v)].dims;
    tables.at(longitude ? 0 : 1) = {std::move(*values), dims[0],
                                    contents.dimensions[static_cast<std::size_t>(dims[1])].length};
  }
  return columns_of(std::move(tables), grid.space[0], {grid.length[0], grid.length[1]},
                    {grid.turned[0], grid.turned[1]});
}

void forget_positions(const ArrayFile& file, const std::vector<DimensionRole>& roles,
                      const GridChoice& choice, std::vector<LeftOut>& left_out) {
  const FileContents& contents = file.contents();
  for (const bool longitude : {true, false}) {
    const int v = position_on(contents, choice.space[0], choice.space[1], longitude);
    const std::size_t d = at(choice.space[longitude ? 0 : 1]);
    std::erase_if(left_out, [&](const LeftOut& left) {
      return (v >= 0 && left.name == contents.variables[at(v)].name) ||
             (roles.at(d).coordinate < 0 && left.name == contents.dimensions[d].name);
    });
  }
}

int grid_mapping_of(const ArrayFile& file, const std::vector<int>& variables,
                    const std::string& coordinate) {
  for (const int v : variables) {
    std::istringstream words(file.contents().variables.at(at(v)).grid_mapping);
    std::string first;
    std::string current;
    std::string chosen;
    for (std::string word; words >> word;) {
      if (current.empty() || word.ends_with(':')) {
        current = word.substr(0, word.find(':'));
        if (first.empty()) first = current;
      } else if (word == coordinate && chosen.empty()) {
        chosen = current;
      }
    }
    const std::string& name = chosen.empty() ? first : chosen;
    const int mapping = name.empty() ? -1 : variable_named(file.contents(), name);
    if (mapping >= 0) return mapping;
  }
  return -1;
}

}  // namespace windsplat::data::cf
