// Directions from the middle of the globe, as vectors in space.
#pragma once

#include <array>
#include <cmath>
#include <numbers>

namespace windsplat::data::cf {

using Direction = std::array<double, 3>;

inline constexpr double unit_degree = std::numbers::pi / 180;  // in radians

// Of unit length, from degrees.
inline Direction direction_of(double longitude, double latitude) {
  const double from_axis = std::cos(latitude * unit_degree);
  return {from_axis * std::cos(longitude * unit_degree),
          from_axis * std::sin(longitude * unit_degree), std::sin(latitude * unit_degree)};
}

inline double dot(const Direction& a, const Direction& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline double distance(const Direction& a, const Direction& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

inline Direction between(const Direction& a, const Direction& b) {
  return {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
}

inline Direction opposite(const Direction& a) { return {-a[0], -a[1], -a[2]}; }

inline Direction unit(const Direction& a) {
  const double length = std::sqrt(dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}

inline Direction cross(const Direction& a, const Direction& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

}  // namespace windsplat::data::cf
