// What angles are measured in: views and grids say degrees, functions take radians.
#pragma once

#include <numbers>

namespace windsplat::scene {

inline constexpr double radians_per_degree = std::numbers::pi / 180.0;

}  // namespace windsplat::scene
