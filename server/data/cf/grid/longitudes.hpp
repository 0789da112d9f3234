#pragma once

#include <vector>

namespace windsplat::data::cf {

// Longitudes in degrees that jump by a turn where they pass the end of their range (359 then 0, 179
// then -180) continue without the jump: 360, 181. Unchanged if they are monotonic as they are, or
// would not be afterwards, or would extend over a turn or more.
void continue_over_seam(std::vector<double>& longitudes);

}  // namespace windsplat::data::cf
