// Scene -> kernel positions along an axis: of a part of the lattice those within its box.
#pragma once

#include "server/engine/plan.hpp"

namespace windsplat::engine {

// Replaces the contents of `axis` by the kernel positions of a stride within a box of samples, and
// their visibility order.
void place_axis(const scene::Scene& scene, int a, int stride, const data::Box& held,
                AxisArrays& axis);

// The widest cell of these kernels; of a part, of those of the whole lattice, since the order of
// equally near bricks may depend on it.
float widest_cell(const scene::Scene& scene, int a, int stride, const AxisArrays& axis);

}  // namespace windsplat::engine
