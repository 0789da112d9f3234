// Conversion of degrees, used by views and grids, to radians.
#pragma once

#include <numbers>

namespace windsplat::scene {

inline constexpr double radians_per_degree = std::numbers::pi / 180.0;

}  // namespace windsplat::scene
