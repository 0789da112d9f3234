// The part of a splat's footprint that lies before a point of a ray: what the slab method adds to
// its slabs. Built once.
#pragma once

#include <cstdint>
#include <vector>

namespace windsplat::engine {

// F(b^2, v) in parts of kernels::partial_one. Row r is b^2 = t^2 r / (rows - 1), a ray's squared
// distance from the centre in strides; column c is v = 2 c / (columns - 1) - 1, a place on it in
// half chords sqrt(t^2 - b^2) from its middle. The table has kernels::partial_rows rows of
// kernels::partial_columns - 1 entries: the lower half of an entry is F at its column, the upper
// half F at the next, so that one look-up gives both. F is 0 at v = -1, 1 at v = 1. It is the
// integral of the kernel K whose projection is the footprint g (inverse Abel transform, K >= 0;
// a = sqrt(t^2 - r^2), b = sqrt(s^2 - r^2)):
//   r < s:       pi K = 2 b / (s t) + 2 / (t (t - s)) (t ln((t + a) / (s + b)) - (a - b))
//   s <= r < t:  pi K = 2 / (t (t - s)) (t ln((t + a) / r) - a)
const std::vector<std::int32_t>& partial_footprints();

}  // namespace windsplat::engine
