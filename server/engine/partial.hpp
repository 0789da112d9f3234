// Table of the fraction of a splat's footprint that lies in front of a point of a ray; the slab
// method uses it to distribute splats over slabs. Built once.
#pragma once

#include <cstdint>
#include <vector>

namespace windsplat::engine {

// F(b^2, v) in units of 1 / kernels::partial_one. Row r is b^2 = t^2 r / (rows - 1), the squared
// distance of a ray from the centre in strides; column c is v = 2 c / (columns - 1) - 1, the
// position along the ray from its middle in half chords sqrt(t^2 - b^2). The table has
// kernels::partial_rows rows of kernels::partial_columns - 1 entries: the lower half of an entry is
// F at its column, the upper half F at the next, so that one look-up returns both. F is 0 at
// v = -1 and 1 at v = 1. It is the integral of the kernel K whose projection is the footprint g
// (inverse Abel transform, K >= 0; a = sqrt(t^2 - r^2), b = sqrt(s^2 - r^2)):
//   r < s:       pi K = 2 b / (s t) + 2 / (t (t - s)) (t ln((t + a) / (s + b)) - (a - b))
//   s <= r < t:  pi K = 2 / (t (t - s)) (t ln((t + a) / r) - a)
const std::vector<std::int32_t>& partial_footprints();

}  // namespace windsplat::engine
