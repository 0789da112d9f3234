// Degrees, used by views and grids, in radians and in metres on the ground.
#pragma once

#include <numbers>

namespace windsplat::scene {

inline constexpr double radians_per_degree = std::numbers::pi / 180.0;
inline constexpr double turn_degrees = 360;
inline constexpr double earth_radius_m = 6371000.0;
inline constexpr double metres_per_degree = earth_radius_m * radians_per_degree;  // of latitude

}  // namespace windsplat::scene
