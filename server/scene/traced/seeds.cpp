#include "server/scene/traced/seeds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "server/scene/refusal.hpp"
#include "server/scene/region/select.hpp"
#include "server/trace/streamlines.hpp"

namespace windsplat::scene {

namespace {

using glm::dvec3;
using protocol::SeedsView;
using protocol::Vec3;

constexpr double turn_degrees = 360;
constexpr int evenly_default = 100;
constexpr std::array<const char*, 3> letters{"x", "y", "z"};

std::string number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.7g", value);
  return text.data();
}

std::string outside(std::size_t axis, double at, const data::Axis& of, bool region) {
  const double low = of.coordinates.front();
  const double high = of.coordinates.back();
  std::string text = std::string(letters.at(axis)) + " = " + number(at) + " is outside of the " +
                     (region ? "region, which keeps " : "data, ") + number(std::min(low, high)) +
                     " to " + number(std::max(low, high));
  if (!of.units.empty()) text += " " + printable(of.units, 80);
  return text;
}

// The index of a coordinate, linear between the samples and in the outer half of the outermost
// cells; nullopt beyond.
std::optional<double> along(const std::vector<double>& coordinates, double at) {
  const bool ascends = coordinates.back() > coordinates.front();
  const auto above = std::partition_point(coordinates.begin(), coordinates.end(),
                                          [&](double c) { return ascends ? c <= at : c >= at; });
  const auto count = static_cast<std::ptrdiff_t>(coordinates.size());
  const std::ptrdiff_t low =
      std::clamp<std::ptrdiff_t>(above - coordinates.begin() - 1, 0, count - 2);
  const double from = coordinates[static_cast<std::size_t>(low)];
  const double to = coordinates[static_cast<std::size_t>(low + 1)];
  const double index = static_cast<double>(low) + (at - from) / (to - from);
  constexpr double slack = 1e-9;
  if (!(index >= -0.5 - slack && index <= static_cast<double>(count) - 0.5 + slack)) {
    return std::nullopt;
  }
  return index;
}

// nullopt: more than half a cell outside.
std::optional<double> along_axis(const data::Axis& axis, double at) {
  const std::vector<double>& c = axis.coordinates;
  if (c.size() < 2) return 0.0;
  const bool round = axis.kind == data::AxisKind::longitude && axis.units.substr(0, 3) != "rad";
  if (!round) {
    if (const auto index = along(c, at)) return *index;
  } else {
    // Of equivalent longitudes the one nearest to the middle of the axis, then its neighbours.
    const double middle = 0.5 * (c.front() + c.back());
    const double near = middle + std::remainder(at - middle, turn_degrees);
    for (const double turns : {0.0, 1.0, -1.0}) {
      if (const auto index = along(c, near + turns * turn_degrees)) return *index;
    }
    // Between the last column and the first one of an axis that closes in steps of other width.
    const double rest = turn_degrees - std::abs(c.back() - c.front());
    const double beyond =
        std::fmod(std::fmod(near - c.back(), turn_degrees) + turn_degrees, turn_degrees);
    const double widest = 1.5 * std::abs(c[1] - c[0]);
    if (c.back() > c.front() && rest > 0 && rest <= widest && beyond <= rest) {
      return static_cast<double>(c.size() - 1) + beyond / rest;
    }
  }
  return std::nullopt;
}

// Whether a height, depth, pressure or number lies between those of the first and the last level:
// no data are beyond. Other axes are of cells, and the outermost ones reach half a cell further.
bool is_between_levels(const data::Axis& vertical, double at) {
  const std::vector<double>& c = vertical.coordinates;
  if (c.size() < 2 || vertical.kind == data::AxisKind::cartesian) return true;
  const auto [low, high] = std::minmax(c.front(), c.back());
  const double slack = 1e-9 * (high - low);
  return at >= low - slack && at <= high + slack;
}

// Longitude and latitude within the quadrilaterals of columns, by the method of Newton from the
// nearest column.
class CellSearch {
 public:
  CellSearch(const data::Columns& columns, const std::array<int, 3>& dims)
      : columns_(columns), dims_(dims) {}

  // Changes x and y; leaves them where the method finds no place within a cell of theirs.
  void refine(double longitude, double latitude, dvec3& index) const {
    if (dims_[0] < 2 || dims_[1] < 2) return;
    constexpr int steps = 20;
    double x = index.x;
    double y = index.y;
    for (int n = 0; n < steps; ++n) {
      const Local at = local(x, y, longitude);
      const double east = longitude - at.longitude;
      const double north = latitude - at.latitude;
      const double det = at.lon_x * at.lat_y - at.lon_y * at.lat_x;
      if (!(std::abs(det) > 0)) return;
      x += (east * at.lat_y - north * at.lon_y) / det;
      y += (north * at.lon_x - east * at.lat_x) / det;
      if (!(std::abs(x - index.x) <= 1.5 && std::abs(y - index.y) <= 1.5)) return;
    }
    index.x = std::clamp(x, -0.5, dims_[0] - 0.5);
    index.y = std::clamp(y, -0.5, dims_[1] - 0.5);
  }

 private:
  struct Local {
    double longitude, latitude, lon_x, lon_y, lat_x, lat_y;
  };

  // `near`: longitudes of the corners are those within half a turn of it.
  [[nodiscard]] Local local(double x, double y, double near) const {
    const int i = std::clamp(static_cast<int>(std::floor(x)), 0, dims_[0] - 2);
    const int j = std::clamp(static_cast<int>(std::floor(y)), 0, dims_[1] - 2);
    const double u = x - i;
    const double v = y - j;
    const auto value = [&](const std::vector<double>& of, int di, int dj) {
      return of[static_cast<std::size_t>(j + dj) * static_cast<std::size_t>(dims_[0]) +
                static_cast<std::size_t>(i + di)];
    };
    const auto longitude = [&](int di, int dj) {
      return near + std::remainder(value(columns_.longitude, di, dj) - near, turn_degrees);
    };
    const auto latitude = [&](int di, int dj) { return value(columns_.latitude, di, dj); };
    const auto bilinear = [&](const auto& corner, double& by_x, double& by_y) {
      const double a = corner(0, 0);
      const double b = corner(1, 0);
      const double c = corner(0, 1);
      const double d = corner(1, 1);
      by_x = (1 - v) * (b - a) + v * (d - c);
      by_y = (1 - u) * (c - a) + u * (d - b);
      return (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
    };
    Local out{};
    out.longitude = bilinear(longitude, out.lon_x, out.lon_y);
    out.latitude = bilinear(latitude, out.lat_x, out.lat_y);
    return out;
  }

  const data::Columns& columns_;
  std::array<int, 3> dims_;
};

// The n-th of `count` places from one end to the other; the middle if there is one.
double part_of(int n, int count) { return count > 1 ? static_cast<double>(n) / (count - 1) : 0.5; }

double mixed(double from, double to, double part) { return (1 - part) * from + part * to; }

Vec3 mixed(const Vec3& from, const Vec3& to, const Vec3& part) {
  Vec3 out{};
  for (std::size_t a = 0; a < 3; ++a) out[a] = mixed(from[a], to[a], part[a]);
  return out;
}

}  // namespace

PlaceSearch::PlaceSearch(const Placed& placed, const data::Axis& vertical,
                         const CancelToken& cancel)
    : grid_(placed.grid), vertical_(vertical), region_(placed.crop.has_value()) {
  if (grid_.columns) columns_.emplace(*grid_.columns, grid_.dims(), cancel);
}

Result<dvec3> PlaceSearch::index_of(const Vec3& at, const std::string& pointer,
                                    const std::string& which) const {
  dvec3 index(0);
  if (columns_) {
    const auto nearest = columns_->nearest(at[0], at[1]);
    if (!nearest) return invalid_at(pointer, which + nearest.error().message);
    index.x = (*nearest)[0];
    index.y = (*nearest)[1];
    CellSearch(*grid_.columns, grid_.dims()).refine(at[0], at[1], index);
  }
  for (std::size_t a = columns_ ? 2 : 0; a < 3; ++a) {
    const data::Axis& axis = a == 2 ? vertical_ : grid_.axes.at(a);
    const auto along = along_axis(axis, at.at(a));
    const bool beyond = a == 2 && !is_between_levels(vertical_, at.at(a));
    if (!along || beyond) return invalid_at(pointer, which + outside(a, at.at(a), axis, region_));
    index[static_cast<glm::length_t>(a)] = *along;
  }
  return index;
}

std::int64_t seeds_in(const SeedsView& seeds) {
  std::int64_t others = static_cast<std::int64_t>(seeds.points.size());
  if (seeds.line) others += seeds.line->count;
  if (seeds.block) {
    std::int64_t product = 1;
    for (const int count : seeds.block->counts) product *= count;
    others += product;
  }
  return others + seeds.evenly.value_or(others > 0 ? 0 : evenly_default);
}

Result<std::vector<dvec3>> seeds_of(const SeedsView& seeds, const Placed& placed,
                                    const data::Axis& vertical, const trace::Flow& flow,
                                    const CancelToken& cancel) {
  const std::string root = "/vector/trace/seeds";
  std::vector<dvec3> out;
  Result<void> good;
  std::optional<PlaceSearch> search;
  const auto add = [&](const Vec3& at, const std::string& pointer, const std::string& which = "") {
    if (!good) return;
    if (!search) search.emplace(placed, vertical, cancel);
    if (cancel.cancelled()) {
      good = make_error(ErrorKind::cancelled, "tracing cancelled");
    } else if (auto index = search->index_of(at, pointer, which)) {
      out.push_back(*index);
    } else {
      good = index.error();
    }
  };
  for (std::size_t n = 0; n < seeds.points.size(); ++n) {
    add(seeds.points[n], root + "/points/" + std::to_string(n));
  }
  if (const auto& line = seeds.line) {
    for (int n = 0; n < line->count; ++n) {
      const double part = part_of(n, line->count);
      const bool between = line->count == 1 || (n > 0 && n + 1 < line->count);
      const char* const end = between ? "/line" : n == 0 ? "/line/from" : "/line/to";
      add(mixed(line->from, line->to, {part, part, part}), root + end,
          between ? "seed " + std::to_string(n + 1) + " of " + std::to_string(line->count) + ": "
                  : std::string());
    }
  }
  if (const auto& block = seeds.block) {
    const auto& [nx, ny, nz] = block->counts;
    for (int z = 0; z < nz; ++z) {
      for (int y = 0; y < ny; ++y) {
        for (int x = 0; x < nx; ++x) {
          add(mixed(block->from, block->to, {part_of(x, nx), part_of(y, ny), part_of(z, nz)}),
              root + "/block");
        }
      }
    }
  }
  if (!good) return good.error();
  const int even = seeds.evenly.value_or(out.empty() ? evenly_default : 0);
  const std::vector<dvec3> places = trace::evenly(flow, even, cancel);
  out.insert(out.end(), places.begin(), places.end());
  return out;
}

}  // namespace windsplat::scene
