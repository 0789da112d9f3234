// Position in the units of a grid, or at heights of its own -> index of the sample whose cell
// contains it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "server/base/check.hpp"
#include "server/data/model/column_search.hpp"
#include "server/data/model/measure.hpp"

namespace windsplat::data {

namespace {

constexpr double turn = 360;
constexpr double radians_per_degree = 3.14159265358979323846 / 180;
// Relative to the size of the box: a computed position may miss the edge by rounding.
constexpr double edge_tolerance = 1e-6;
// Of coordinates in requests: of any data, and of those with longitudes and latitudes.
constexpr std::array<const char*, 3> letters{"x", "y", "z (or level)"};
constexpr std::array<const char*, 3> geographic_letters{"x (or lon)", "y (or lat)", "z (or level)"};

std::string number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.7g", value);
  return text.data();
}

std::string interval(const std::array<double, 2>& box, const std::string& units) {
  std::string text = number(box[0]);
  text.append(" to ").append(number(box[1]));
  if (!units.empty()) text.append(" ").append(printable(units, 80));
  return text;
}

Error outside(const char* letter, double at, const std::string& box) {
  std::string message = letter;
  message.append(" = ").append(number(at)).append(" is outside the box of the data: ").append(box);
  return make_error(ErrorKind::invalid, std::move(message));
}

Error absent(const char* letter) {
  return make_error(ErrorKind::invalid, std::string(letter) + " is required");
}

bool goes_round(const Axis& axis) {
  return axis.kind == AxisKind::longitude && axis.units.substr(0, 3) != "rad";
}

double distance_along(double a, double b, bool round) {
  return std::abs(round ? std::remainder(a - b, turn) : a - b);
}

// The range from half a cell below the least coordinate of the axis to half a cell above its
// greatest.
std::array<double, 2> box_of(const Axis& axis) {
  const std::vector<double>& c = axis.coordinates;
  const std::size_t n = c.size();
  std::array<double, 2> box{c.front() - (c[1] - c[0]) / 2, c.back() + (c[n - 1] - c[n - 2]) / 2};
  if (box[0] > box[1]) std::swap(box[0], box[1]);
  if (axis.kind == AxisKind::latitude && axis.units.substr(0, 3) != "rad") {
    box[0] = std::min(std::max(box[0], -90.0), std::min(c.front(), c.back()));
    box[1] = std::max(std::min(box[1], 90.0), std::max(c.front(), c.back()));
  }
  return box;
}

bool within(const std::array<double, 2>& box, double at, bool round) {
  const double slack = edge_tolerance * (box[1] - box[0]);
  if (!round) return at >= box[0] - slack && at <= box[1] + slack;
  // The smallest equivalent longitude at or beyond the lower end of the box.
  const double first = box[0] - slack;
  return at + turn * std::ceil((first - at) / turn) <= box[1] + slack;
}

Result<int> nearest_along(const Axis& axis, std::size_t index, const std::optional<double>& at) {
  if (axis.coordinates.size() == 1) return 0;
  const bool geographic = axis.kind == AxisKind::longitude || axis.kind == AxisKind::latitude;
  const char* const letter = (geographic ? geographic_letters : letters)[index];
  if (!at) return absent(letter);
  const bool round = goes_round(axis);
  const std::array<double, 2> box = box_of(axis);
  if (!within(box, *at, round)) return outside(letter, *at, interval(box, axis.units));
  const auto nearest =
      std::min_element(axis.coordinates.begin(), axis.coordinates.end(), [&](double a, double b) {
        return distance_along(a, *at, round) < distance_along(b, *at, round);
      });
  return static_cast<int>(nearest - axis.coordinates.begin());
}

// Distance in degrees of arc, from haversines, which are exact for small distances.
double distance(double lon_a, double lat_a, double lon_b, double lat_b) {
  const double across = std::sin((lon_a - lon_b) * radians_per_degree / 2);
  const double along = std::sin((lat_a - lat_b) * radians_per_degree / 2);
  const double h = along * along + std::cos(lat_a * radians_per_degree) *
                                       std::cos(lat_b * radians_per_degree) * across * across;
  return 2 * std::asin(std::sqrt(std::clamp(h, 0.0, 1.0))) / radians_per_degree;
}

// Half the distance to the farthest neighbour of the column: bounds its cell.
double reach(const Columns& columns, const std::array<int, 3>& dims, int x, int y) {
  const auto at = [&](int i, int j) {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(dims[0]) +
           static_cast<std::size_t>(i);
  };
  const std::size_t own = at(x, y);
  double farthest = 0;
  for (int j = std::max(0, y - 1); j <= std::min(dims[1] - 1, y + 1); ++j) {
    for (int i = std::max(0, x - 1); i <= std::min(dims[0] - 1, x + 1); ++i) {
      const std::size_t other = at(i, j);
      farthest = std::max(farthest, distance(columns.longitude[own], columns.latitude[own],
                                             columns.longitude[other], columns.latitude[other]));
    }
  }
  return farthest / 2;
}

Error beyond_poles(double latitude) {
  return outside(geographic_letters[1], latitude,
                 "x and y are longitude and latitude here, which must be from -90 to 90 degrees");
}

// The nearest column and its distance; an error if the place is outside of its cell, which only
// those of the rim can tell.
Result<std::array<int, 2>> within_reach(const Columns& columns, const std::array<int, 3>& dims,
                                        double longitude, double latitude, std::size_t nearest,
                                        double least) {
  const int x = static_cast<int>(nearest % static_cast<std::size_t>(dims[0]));
  const int y = static_cast<int>(nearest / static_cast<std::size_t>(dims[0]));
  const bool rim = x == 0 || y == 0 || x == dims[0] - 1 || y == dims[1] - 1;
  if (rim && columns.latitude.size() > 1 &&
      least > reach(columns, dims, x, y) * (1 + edge_tolerance)) {
    const auto [west, east] =
        std::minmax_element(columns.longitude.begin(), columns.longitude.end());
    const auto [south, north] =
        std::minmax_element(columns.latitude.begin(), columns.latitude.end());
    std::string box = "no column is near latitude ";
    box.append(number(latitude)).append("; columns are at longitudes ");
    box.append(interval({*west, *east}, "")).append(", latitudes ");
    box.append(interval({*south, *north}, "degrees"));
    return outside(geographic_letters[0], longitude, box);
  }
  return std::array{x, y};
}

Result<void> nearest_column(const Grid& grid, const std::array<std::optional<double>, 3>& at,
                            Place& place) {
  const Columns& columns = *grid.columns;
  const std::array<int, 3> dims = grid.dims();
  WINDSPLAT_CHECK(columns.longitude.size() == columns.latitude.size() &&
                  columns.longitude.size() ==
                      static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]));
  if (!at[0]) return absent(geographic_letters[0]);
  if (!at[1]) return absent(geographic_letters[1]);
  if (std::abs(*at[1]) > 90) return beyond_poles(*at[1]);
  double least = std::numeric_limits<double>::infinity();
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < columns.latitude.size(); ++i) {
    // A great-circle distance is never less than the difference in latitude.
    if (std::abs(columns.latitude[i] - *at[1]) >= least) continue;
    const double d = distance(*at[0], *at[1], columns.longitude[i], columns.latitude[i]);
    if (d >= least) continue;
    least = d;
    nearest = i;
  }
  const auto found = within_reach(columns, dims, *at[0], *at[1], nearest, least);
  if (!found) return found.error();
  place.index[0] = (*found)[0];
  place.index[1] = (*found)[1];
  place.coordinates[0] = columns.longitude[nearest];
  place.coordinates[1] = columns.latitude[nearest];
  return {};
}

// The levels of one column, at their heights there.
Result<Axis> levels_of(const Grid& grid, const SampleHeights& heights, std::array<int, 3> column) {
  Axis levels = grid.axes[2];
  levels.kind = AxisKind::height;
  levels.units = heights.units;
  for (std::size_t k = 0; k < levels.coordinates.size(); ++k) {
    column[2] = static_cast<int>(k);
    const auto height = value_at(*heights.values, column);
    if (!height) {
      return make_error(ErrorKind::invalid,
                        "level " + std::to_string(k) + " has no height at this position");
    }
    levels.coordinates[k] = height->front();
  }
  return levels;
}

}  // namespace

Result<Place> nearest_sample(const Grid& grid, const std::array<std::optional<double>, 3>& at,
                             const SampleHeights* heights) {
  Place place;
  std::size_t first_plain = 0;
  if (grid.columns) {
    if (auto found = nearest_column(grid, at, place); !found) return found.error();
    first_plain = 2;
  }
  for (std::size_t a = first_plain; a < 3; ++a) {
    std::optional<Axis> levels;
    if (a == 2 && heights != nullptr) {
      auto found = levels_of(grid, *heights, place.index);
      if (!found) return found.error();
      levels = std::move(*found);
    }
    const Axis& axis = levels ? *levels : grid.axes[a];
    const auto index = nearest_along(axis, a, at[a]);
    if (!index) return index.error();
    place.index[a] = *index;
    place.coordinates[a] = axis.coordinates[static_cast<std::size_t>(*index)];
  }
  return place;
}

ColumnSearch::ColumnSearch(const Columns& columns, const std::array<int, 3>& dims,
                           const CancelToken& cancel)
    : columns_(columns), dims_(dims) {
  for (std::size_t n = 0; n < columns.longitude.size(); ++n) {
    const double longitude = columns.longitude[n];
    const double latitude = columns.latitude[n];
    if (!std::isfinite(longitude) || !std::isfinite(latitude)) continue;
    nodes_.push_back({unit_vector(longitude, latitude), n});
  }
  sort(0, nodes_.size(), 0, cancel);
}

std::array<double, 3> ColumnSearch::unit_vector(double longitude, double latitude) {
  const double x = longitude * radians_per_degree;
  const double y = latitude * radians_per_degree;
  return {std::cos(y) * std::cos(x), std::cos(y) * std::sin(x), std::sin(y)};
}

void ColumnSearch::sort(std::size_t first, std::size_t last, std::size_t axis,
                        const CancelToken& cancel) {
  if (last - first < 2 || cancel.cancelled()) return;
  const std::size_t middle = first + (last - first) / 2;
  const auto at = [this](std::size_t n) { return nodes_.begin() + static_cast<std::ptrdiff_t>(n); };
  std::nth_element(at(first), at(middle), at(last), [axis](const Node& a, const Node& b) {
    return a.place.at(axis) < b.place.at(axis);
  });
  sort(first, middle, (axis + 1) % 3, cancel);
  sort(middle + 1, last, (axis + 1) % 3, cancel);
}

void ColumnSearch::seek(const std::array<double, 3>& place, std::size_t first, std::size_t last,
                        std::size_t axis, Best& best) const {
  if (first >= last) return;
  const std::size_t middle = first + (last - first) / 2;
  const Node& node = nodes_[middle];
  double square = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    square += (node.place.at(a) - place.at(a)) * (node.place.at(a) - place.at(a));
  }
  if (square < best.square || (square == best.square && node.column < best.column)) {
    best = {square, node.column};
  }
  const double side = place.at(axis) - node.place.at(axis);
  const std::size_t next = (axis + 1) % 3;
  for (const bool below : {side < 0, side >= 0}) {
    if (below != (side < 0) && side * side > best.square) return;
    if (below) {
      seek(place, first, middle, next, best);
    } else {
      seek(place, middle + 1, last, next, best);
    }
  }
}

Result<std::array<int, 2>> ColumnSearch::nearest(double longitude, double latitude) const {
  if (std::abs(latitude) > 90) return beyond_poles(latitude);
  if (nodes_.empty()) return outside(geographic_letters[0], longitude, "no column has a place");
  Best best{std::numeric_limits<double>::infinity(), 0};
  seek(unit_vector(longitude, latitude), 0, nodes_.size(), 0, best);
  const double least = distance(longitude, latitude, columns_.longitude[best.column],
                                columns_.latitude[best.column]);
  return within_reach(columns_, dims_, longitude, latitude, best.column, least);
}

}  // namespace windsplat::data
