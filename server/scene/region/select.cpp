#include "server/scene/region/select.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <utility>
#include <vector>

#include "server/scene/angles.hpp"
#include "server/scene/refusal.hpp"
#include "server/scene/region/polygon.hpp"

namespace windsplat::scene {

namespace {

using data::Axis;
using data::AxisKind;
using protocol::Range;
using protocol::RegionView;

constexpr double degrees_max = 720;      // of longitudes of polygons, either way
constexpr double range_rounding = 1e-9;  // of the coordinates and ends of ranges

std::string text_of(double low, double high) {
  std::ostringstream text;
  text << std::setprecision(10) << low << " to " << high;
  return text.str();
}

std::string text_of(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return text_of(*low, *high);
}

// Degrees eastward from low to high, at most a turn.
double eastward(const Range& range) {
  double span = range[1] - range[0];
  if (span < 0) span += turn_degrees * std::ceil(-span / turn_degrees);
  return std::min(span, turn_degrees);
}

bool is_between_longitudes(double longitude, const Range& range) {
  double from = std::fmod(longitude - range[0], turn_degrees);
  if (from < 0) from += turn_degrees;
  const double margin = range_rounding * turn_degrees;
  return from <= eastward(range) + margin || from >= turn_degrees - margin;
}

bool is_between(double value, const Range& range) {
  const auto [low, high] = std::minmax(range[0], range[1]);
  const double margin = range_rounding * std::max(std::abs(low), std::abs(high));
  return value >= low - margin && value <= high + margin;
}

// A run of samples along an axis: `count` from `first` on.
struct Run {
  int first = 0;
  int count = 0;
};

// The shortest run that holds all marked samples; along a closed circle of `turn` samples (0: not
// closed) it may pass the last one, which it does only if it becomes shorter.
Run run_of(const std::vector<unsigned char>& marked, int turn) {
  const int size = static_cast<int>(marked.size());
  int first = 0;
  while (first < size && marked[static_cast<std::size_t>(first)] == 0) ++first;
  if (first == size) return {};
  int last = size - 1;
  while (marked[static_cast<std::size_t>(last)] == 0) --last;
  Run run{first, last - first + 1};
  if (turn == 0) return run;
  int gap = 0;  // the longest run of samples between marked ones
  int next = 0;
  for (int i = first, empty = 0; i < std::min(turn, last + 1); ++i) {
    empty = marked[static_cast<std::size_t>(i)] == 0 ? empty + 1 : 0;
    if (empty <= gap) continue;
    gap = empty;
    next = i + 1;
  }
  if (turn - gap < run.count && gap > 0) return {next % turn, turn - gap};
  return run;
}

// `columns`: of a grid whose columns have longitudes and latitudes of their own.
Error empty(const char* key, const Range& range, const Axis& axis, bool columns) {
  std::ostringstream text;
  text << "no sample of axis " << in_double_quotes(axis.name) << " is within "
       << text_of(range[0], range[1]) << ": its coordinates are " << text_of(axis.coordinates);
  if (!axis.units.empty()) text << ' ' << printable(axis.units, 80);
  // Of a range between two samples it would seem to contradict itself.
  const double* below = nullptr;
  const double* above = nullptr;
  for (const double& one : axis.coordinates) {
    if (one < range[0] && (below == nullptr || one > *below)) below = &one;
    if (one > range[1] && (above == nullptr || one < *above)) above = &one;
  }
  if (below != nullptr && above != nullptr) {
    text << ", of which those beside it are " << text_of(*below, *above);
  }
  if (columns && *key != 'z') text << "; /region/longitudes and /region/latitudes take degrees";
  return invalid_at(std::string("/region/") + key, text.str());
}

Result<Run> along_axis(const std::optional<Range>& range, const char* key, const Axis& axis,
                       int turn, bool columns) {
  if (!range) return Run{0, static_cast<int>(axis.coordinates.size())};
  const bool longitudes = axis.kind == AxisKind::longitude;
  std::vector<unsigned char> marked;
  marked.reserve(axis.coordinates.size());
  for (const double at : axis.coordinates) {
    marked.push_back(longitudes ? is_between_longitudes(at, *range) : is_between(at, *range));
  }
  const Run run = run_of(marked, turn);
  if (run.count == 0) return empty(key, *range, axis, columns);
  for (int i = run.first; i < run.first + run.count; ++i) {
    const int at = turn > 0 ? i % turn : i;
    if (marked[static_cast<std::size_t>(at)] != 0) continue;
    return invalid_at(std::string("/region/") + key,
                      "the longitudes " + text_of((*range)[0], (*range)[1]) +
                          " hold both ends of axis " + in_double_quotes(axis.name) + ", from " +
                          text_of(axis.coordinates) + ", which does not go around the globe");
  }
  return run;
}

// Positions of columns in the coordinates of a polygon.
struct ColumnPlaces {
  const data::Grid& grid;
  bool degrees = false;
  [[nodiscard]] std::array<double, 2> at(int i, int j) const {
    const auto x = static_cast<std::size_t>(i);
    const auto y = static_cast<std::size_t>(j);
    if (const auto& columns = grid.columns) {
      const std::size_t n = y * static_cast<std::size_t>(grid.dims()[0]) + x;
      return {columns->longitude[n], columns->latitude[n]};
    }
    return {grid.axes[0].coordinates[x], grid.axes[1].coordinates[y]};
  }
};

bool has_degrees(const data::Grid& grid) {
  return grid.columns ||
         (grid.axes[0].kind == AxisKind::longitude && grid.axes[1].kind == AxisKind::latitude);
}

bool contains(const Inside& inside, bool degrees, const std::array<double, 2>& at) {
  if (!degrees) return inside.contains(at[0], at[1]);
  const auto [low, high] = inside.extent();
  const auto first = static_cast<int>(std::ceil((low - at[0]) / turn_degrees));
  const auto last = static_cast<int>(std::floor((high - at[0]) / turn_degrees));
  for (int turn = first; turn <= last; ++turn) {
    if (inside.contains(at[0] + turn_degrees * turn, at[1])) return true;
  }
  return false;
}

// The key that a message names: the one that a column is most likely to fail.
const char* key_of_columns(const RegionView& region) {
  if (!region.polygon.empty()) return "/region/polygon";
  return region.longitudes ? "/region/longitudes" : "/region/latitudes";
}

std::string text_of_columns(const data::Grid& grid) {
  if (const auto& columns = grid.columns) {
    return "longitudes " + text_of(columns->longitude) + " and latitudes " +
           text_of(columns->latitude);
  }
  return in_double_quotes(grid.axes[0].name) + " " + text_of(grid.axes[0].coordinates) + " and " +
         in_double_quotes(grid.axes[1].name) + " " + text_of(grid.axes[1].coordinates);
}

// Narrows the crop to the columns within the region, and masks the others in it.
Result<void> crop_columns(const RegionView& region, const data::Grid& grid, Crop& crop) {
  const ColumnPlaces places{grid, has_degrees(grid)};
  if ((region.longitudes || region.latitudes) && !places.degrees) {
    return invalid_at(region.longitudes ? "/region/longitudes" : "/region/latitudes",
                      "requires longitudes and latitudes, which this dataset lacks: use x and y");
  }
  const Inside inside(region.polygon);
  const auto [west, east] = inside.extent();
  if (places.degrees && !region.polygon.empty() && !(west >= -degrees_max && east <= degrees_max)) {
    return invalid_at("/region/polygon", "has longitudes from " + text_of(west, east) +
                                             ", beyond the limit of " +
                                             text_of(-degrees_max, degrees_max) + " degrees");
  }
  const auto [width, height, levels] = crop.count;
  std::vector<unsigned char> kept(static_cast<std::size_t>(width) *
                                  static_cast<std::size_t>(height));
  std::vector<unsigned char> in_x(static_cast<std::size_t>(width), 0);
  std::vector<unsigned char> in_y(static_cast<std::size_t>(height), 0);
  std::size_t n = 0;
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i, ++n) {
      const auto at = places.at(crop.x_of(i), crop.first[1] + j);
      const bool is_kept =
          (!region.longitudes || is_between_longitudes(at[0], *region.longitudes)) &&
          (!region.latitudes || is_between(at[1], *region.latitudes)) &&
          (region.polygon.empty() || contains(inside, places.degrees, at));
      if (!is_kept) continue;
      kept[n] = in_x[static_cast<std::size_t>(i)] = in_y[static_cast<std::size_t>(j)] = 1;
    }
  }
  const bool closes = crop.turn > 0 && width >= crop.turn;
  const Run x = run_of(in_x, closes ? crop.turn : 0);
  const Run y = run_of(in_y, 0);
  if (x.count == 0) {
    return invalid_at(key_of_columns(region),
                      "no column is within the region: the columns have " + text_of_columns(grid));
  }
  std::vector<unsigned char> columns;
  columns.reserve(static_cast<std::size_t>(x.count) * static_cast<std::size_t>(y.count));
  for (int j = y.first; j < y.first + y.count; ++j) {
    for (int i = x.first; i < x.first + x.count; ++i) {
      const int at = i < width ? i : i - crop.turn;
      columns.push_back(kept[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                             static_cast<std::size_t>(at)]);
    }
  }
  crop.first[0] += x.first;
  crop.first[1] += y.first;
  crop.count[0] = x.count;
  crop.count[1] = y.count;
  if (std::find(columns.begin(), columns.end(), 0) != columns.end()) {
    crop.columns = std::make_shared<const std::vector<unsigned char>>(std::move(columns));
  }
  return {};
}

}  // namespace

bool is_cropped(const RegionView& region) {
  return region.x || region.y || region.z || region.longitudes || region.latitudes ||
         !region.polygon.empty();
}

int samples_around(const data::Grid& grid) {
  const Axis& x = grid.axes[0];
  const std::vector<double>& at = x.coordinates;
  if (x.kind != AxisKind::longitude || grid.columns || at.size() < 3) return 0;
  double widest = 0;
  for (std::size_t i = 1; i < at.size(); ++i) widest = std::max(widest, at[i] - at[i - 1]);
  const double rest = turn_degrees - (at.back() - at.front());
  constexpr double next = 1.5;  // steps, as columns_around()
  constexpr double same = 0.01;
  if (std::abs(rest) <= same * widest) return static_cast<int>(at.size()) - 1;
  return rest > 0 && rest <= next * widest ? static_cast<int>(at.size()) : 0;
}

Result<Crop> crop_of(const RegionView& region, const data::Grid& grid, int around) {
  const int turn = grid.columns ? around : samples_around(grid);
  const bool columns = grid.columns != nullptr;
  const auto x = along_axis(region.x, "x", grid.axes[0], turn, columns);
  if (!x) return x.error();
  const auto y = along_axis(region.y, "y", grid.axes[1], 0, columns);
  if (!y) return y.error();
  const auto z = along_axis(region.z, "z", grid.axes[2], 0, columns);
  if (!z) return z.error();
  Crop crop;
  crop.first = {x->first, y->first, z->first};
  crop.count = {x->count, y->count, z->count};
  crop.turn = turn;
  if (region.longitudes || region.latitudes || !region.polygon.empty()) {
    if (auto ok = crop_columns(region, grid, crop); !ok) return ok.error();
  }
  if (turn > 0) crop.first[0] %= turn;
  if (crop.first[0] + crop.count[0] <= grid.dims()[0]) crop.turn = 0;
  return crop;
}

}  // namespace windsplat::scene
