#include "server/ground/map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>

#include "server/base/check.hpp"

namespace windsplat::ground {

namespace {

constexpr double radians = std::numbers::pi / 180;

// Of the way along a parallel in degrees of longitude.
double shrinking(double latitude) { return std::max(std::cos(latitude * radians), 1e-9); }

// A position between neighbours: the first of them, and the part of the way to the second.
struct Between {
  std::size_t first = 0;
  double part = 0;
  double width = 1;
};

Between between(const std::vector<double>& positions, double at) {
  const auto after = std::upper_bound(positions.begin() + 1, positions.end() - 1, at);
  const auto n = static_cast<std::size_t>(after - positions.begin()) - 1;
  const double width = positions[n + 1] - positions[n];
  return {n, (at - positions[n]) / width, width};
}

// The value and its slope.
std::array<double, 2> value_at(const Axis& axis, double at) {
  const Between b = between(axis.positions, at);
  const double step = axis.degrees[b.first + 1] - axis.degrees[b.first];
  return {axis.degrees[b.first] + b.part * step, step / b.width};
}

bool is_axis(const std::vector<double>& positions) {
  return positions.size() >= 2 && positions.back() > positions.front();
}

}  // namespace

Located Globe::locate(const glm::dvec3& point) const {
  const double across = std::hypot(point.x, point.y);
  const double radius = std::hypot(across, point.z);
  if (!(radius > 0)) return {};
  const double least = 1e-12 * radius;
  const double sine = across > least ? point.x / across : 0.0;  // of the longitude
  const double cosine = across > least ? -point.y / across : 1.0;
  Located at;
  at.place = {std::atan2(sine, cosine) / radians, std::atan2(point.z, across) / radians};
  const double scale = 1 / (radius * radians);
  at.east = scale * glm::dvec3(cosine, sine, 0);
  const double rise = point.z / radius;
  at.north = scale * glm::dvec3(-rise * sine, rise * cosine, across / radius);
  return at;
}

glm::dvec3 Globe::up(const glm::dvec3& point) const {
  const double radius = glm::length(point);
  return radius > 0 ? point / radius : glm::dvec3(0, 0, 1);
}

// The first number is that of the kind of map.
void Globe::identify(Identity& to) const { to.numbers.push_back(1); }

void AxesMap::identify(Identity& to) const {
  to.numbers.push_back(2);
  for (const Axis* axis : {&x_, &y_}) {
    to.add(axis->degrees);
    to.add(axis->positions);
  }
}

void ColumnsMap::identify(Identity& to) const {
  to.numbers.push_back(3);
  to.add(columns_.x);
  to.add(columns_.y);
  to.shared.emplace_back(columns_.longitudes);
  to.shared.emplace_back(columns_.latitudes);
}

AxesMap::AxesMap(Axis x, Axis y) : x_(std::move(x)), y_(std::move(y)) {
  WINDSPLAT_CHECK(is_axis(x_.positions) && x_.degrees.size() == x_.positions.size());
  WINDSPLAT_CHECK(is_axis(y_.positions) && y_.degrees.size() == y_.positions.size());
}

Located AxesMap::locate(const glm::dvec3& point) const {
  const auto [longitude, along_x] = value_at(x_, point.x);
  const auto [latitude, along_y] = value_at(y_, point.y);
  return {{longitude, latitude}, {shrinking(latitude) * along_x, 0, 0}, {0, along_y, 0}};
}

ColumnsMap::ColumnsMap(Columns columns) : columns_(std::move(columns)) {
  const std::size_t count = columns_.x.size() * columns_.y.size();
  WINDSPLAT_CHECK(is_axis(columns_.x) && is_axis(columns_.y));
  WINDSPLAT_CHECK(columns_.longitudes->size() == count && columns_.latitudes->size() == count);
}

Located ColumnsMap::locate(const glm::dvec3& point) const {
  const Between u = between(columns_.x, point.x);
  const Between v = between(columns_.y, point.y);
  const std::size_t width = columns_.x.size();
  const std::size_t n = v.first * width + u.first;
  // The value and its derivatives along x and y.
  const auto at = [&](const std::vector<double>& values, double period) {
    const double origin = values[n];
    const auto value = [&](std::size_t m) {
      const double step = values[m] - origin;
      return period > 0 ? std::remainder(step, period) : step;
    };
    const double a = value(n + 1);
    const double b = value(n + width);
    const double c = value(n + width + 1);
    const double twist = c - a - b;
    return std::array{origin + u.part * a + v.part * b + u.part * v.part * twist,
                      (a + v.part * twist) / u.width, (b + u.part * twist) / v.width};
  };
  const auto longitude = at(*columns_.longitudes, 360);
  const auto latitude = at(*columns_.latitudes, 0);
  const double shrink = shrinking(latitude[0]);
  return {{longitude[0], latitude[0]},
          {shrink * longitude[1], shrink * longitude[2], 0},
          {latitude[1], latitude[2], 0}};
}

}  // namespace windsplat::ground
