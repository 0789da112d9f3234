// How far lines of a level lie from the positions of their kernels, and how wide the boxes are to
// which they are clipped: bounds in cells of the level.
#pragma once

#include <array>
#include <cstddef>

#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The width of the box of one kernel at full detail, at most; at least 1.
double widest_box(const VectorLayer& layer, std::size_t axis);

// From the position of a cell of a coarser level to that of a sample in it, at most.
double farthest_place(const VectorLayer& layer, std::size_t axis);

// Bound on the extent of lines beyond the positions of their kernels along each axis, world units.
// `cells`: the widest cells of the level, times the stride of its lines.
std::array<double, 3> line_reach(const VectorLayer& layer, const std::array<double, 3>& cells);

}  // namespace windsplat::scene
