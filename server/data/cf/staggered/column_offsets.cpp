#include "server/data/cf/staggered/column_offsets.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <sstream>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/fields/fields.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/grid/cell_lists.hpp"

namespace windsplat::data::cf {

namespace {

constexpr std::size_t samples_compared = 100'000;
constexpr std::size_t columns_max = std::size_t{1} << 24;  // more are not placed by positions

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Positions of rows and columns, and who names them.
struct Points {
  int longitude = -1;
  int latitude = -1;
  std::vector<int> variables;
  std::size_t scalars = 0;  // of those, the ones without the name of a velocity
};

class OffsetFinder {
 public:
  explicit OffsetFinder(const ArrayFile& file) : file_(file), contents_(file.contents()) {
    out_.staggers.resize(contents_.variables.size());
    out_.unread.resize(contents_.variables.size());
  }

  Result<ColumnOffsets> find() {
    std::map<std::vector<int>, std::vector<Points>> grids;  // by dimensions
    for (std::size_t v = 0; v < contents_.variables.size(); ++v)
      collect(static_cast<int>(v), grids);
    for (const auto& [dims, all] : grids) {
      const std::size_t rows = contents_.dimensions.at(at(dims[0])).length;
      const std::size_t width = contents_.dimensions.at(at(dims[1])).length;
      if (all.size() < 2 || width == 0 || rows > columns_max / width) continue;
      if (auto done = compare(dims, all); !done) return done.error();
    }
    return std::move(out_);
  }

 private:
  [[nodiscard]] const FileVariable& variable(int v) const { return contents_.variables.at(at(v)); }

  void collect(int v, std::map<std::vector<int>, std::vector<Points>>& grids) const {
    const FileVariable& own = variable(v);
    if (!own.numeric || own.dims.size() < 2 || own.coordinates.empty() || is_position(own)) return;
    std::array<int, 2> named{-1, -1};
    std::istringstream words(own.coordinates);
    for (std::string word; words >> word;) {
      const int found = variable_named(contents_, word);
      if (found < 0 || !variable(found).numeric || variable(found).dims.size() != 2) continue;
      const int side = side_of(variable(found));
      if (side != 0) named.at(side < 0 ? 0 : 1) = found;
    }
    const int longitude = named[0];
    const int latitude = named[1];
    if (longitude < 0 || latitude < 0 || variable(longitude).dims != variable(latitude).dims)
      return;
    const std::vector<int>& dims = variable(longitude).dims;
    const bool lies_there = std::all_of(dims.begin(), dims.end(), [&](int d) {
      return std::count(own.dims.begin(), own.dims.end(), d) > 0;
    });
    if (!lies_there) return;
    std::vector<Points>& all = grids[dims];
    auto points = std::find_if(all.begin(), all.end(), [&](const Points& one) {
      return one.longitude == longitude && one.latitude == latitude;
    });
    if (points == all.end()) {
      all.push_back({longitude, latitude, {}, 0});
      points = std::prev(all.end());
    }
    points->variables.push_back(v);
    const bool flows = is_velocity_component(own) || (own.units.empty() && has_velocity_name(own));
    points->scalars += flows ? 0U : 1U;
  }

  [[nodiscard]] std::string names_of(const Points& points) const {
    return in_quotes(variable(points.longitude).name) + " and " +
           in_quotes(variable(points.latitude).name);
  }

  Result<void> compare(const std::vector<int>& dims, const std::vector<Points>& all) {
    const auto centers =
        std::max_element(all.begin(), all.end(), [](const Points& a, const Points& b) {
          return std::pair(a.scalars, a.variables.size()) <
                 std::pair(b.scalars, b.variables.size());
        });
    auto places = column_places(file_, centers->longitude, centers->latitude);
    if (!places) return places.error();
    for (auto points = all.begin(); points != all.end(); ++points) {
      if (points == centers) continue;
      auto others = column_places(file_, points->longitude, points->latitude);
      if (!others) return others.error();
      place(dims, *points, names_of(*centers), offset_in_cells(*places, *others));
      for (const int v : {points->longitude, points->latitude}) {
        if (v == centers->longitude || v == centers->latitude) continue;
        out_.unread[at(v)] = "the rows and columns are placed by " + names_of(*centers);
      }
    }
    return {};
  }

  void place(const std::vector<int>& dims, const Points& points, const std::string& centers,
             const std::optional<std::array<double, 2>>& offset) {
    std::array<std::optional<std::ptrdiff_t>, 2> first;
    bool is_known = offset.has_value();
    for (std::size_t a = 0; is_known && a < 2; ++a) {
      if (std::abs(offset->at(a)) <= offset_tolerance) continue;
      first.at(a) = first_face_at(offset->at(a));
      is_known = first.at(a).has_value();
    }
    for (const int v : points.variables) {
      if (!is_known) {
        out_.unread[at(v)] = "its positions, " + names_of(points) +
                             ", are neither those of the grid, " + centers +
                             ", nor half a cell beside them";
        continue;
      }
      if (!first[0] && !first[1]) continue;
      std::vector<Stagger>& staggers = out_.staggers[at(v)];
      for (const int d : variable(v).dims) {
        Stagger stagger;
        for (std::size_t a = 0; a < 2; ++a) {
          if (d == dims[a] && first.at(a)) stagger = {d, false, *first.at(a)};
        }
        staggers.push_back(std::move(stagger));
      }
    }
  }

  const ArrayFile& file_;
  const FileContents& contents_;
  ColumnOffsets out_;
};

}  // namespace

Result<ColumnPlaces> column_places(const ArrayFile& file, int longitude, int latitude) {
  ColumnPlaces out;
  const FileContents& contents = file.contents();
  out.width = contents.dimensions.at(at(contents.variables.at(at(longitude)).dims.at(1))).length;
  for (const int v : {longitude, latitude}) {
    auto values = unpacked_degrees(file, v);
    if (!values) return values.error();
    (v == longitude ? out.longitude : out.latitude) = std::move(*values);
  }
  return out;
}

std::optional<std::array<double, 2>> offset_in_cells(const ColumnPlaces& a, const ColumnPlaces& b) {
  const std::size_t width = a.width;
  const std::size_t height = a.longitude.size() / std::max<std::size_t>(width, 1);
  if (b.width != width || b.longitude.size() != a.longitude.size() || width < 2 || height < 2) {
    return std::nullopt;
  }
  // Some of each row suffice.
  const std::size_t stride = std::max<std::size_t>(1, a.longitude.size() / samples_compared);
  std::array<std::vector<double>, 2> all;
  for (std::size_t j = 0; j + 1 < height; ++j) {
    for (std::size_t i = j % stride; i + 1 < width; i += stride) {
      const std::size_t n = j * width + i;
      const double shrink = std::cos(a.latitude[n] * std::numbers::pi / 180);
      const auto step = [&](const ColumnPlaces& to, std::size_t m) {
        return std::array<double, 2>{
            std::remainder(to.longitude[m] - a.longitude[n], 360.0) * shrink,
            to.latitude[m] - a.latitude[n]};
      };
      const auto along_rows = step(a, n + width);
      const auto along_columns = step(a, n + 1);
      const auto way = step(b, n);
      const double area = along_rows[0] * along_columns[1] - along_rows[1] * along_columns[0];
      const double rows = (way[0] * along_columns[1] - way[1] * along_columns[0]) / area;
      const double columns = (along_rows[0] * way[1] - along_rows[1] * way[0]) / area;
      if (!std::isfinite(rows) || !std::isfinite(columns)) continue;
      all[0].push_back(rows);
      all[1].push_back(columns);
    }
  }
  if (all[0].empty()) return std::nullopt;
  return std::array<double, 2>{median(all[0]), median(all[1])};
}

std::optional<std::ptrdiff_t> first_face_at(double cells) {
  if (!(std::abs(std::abs(cells) - 0.5) <= offset_tolerance)) return std::nullopt;
  return cells > 0 ? -1 : 0;
}

Result<ColumnOffsets> find_column_offsets(const ArrayFile& file) {
  return OffsetFinder(file).find();
}

}  // namespace windsplat::data::cf
