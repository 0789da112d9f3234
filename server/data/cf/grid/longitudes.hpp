#pragma once

#include <vector>

namespace windsplat::data::cf {

// Longitudes in degrees that jump by a turn where they pass the end of their range (359 then 0, 179
// then -180) continue without the jump: 360, 181. Unchanged if they are monotonic as they are, or
// would not be afterwards, or would extend over more than a turn.
void continue_over_seam(std::vector<double>& longitudes);

// The longitudes by as many turns further as they begin nearest to others.
std::vector<double> turned_near(std::vector<double> longitudes, const std::vector<double>& others);

}  // namespace windsplat::data::cf
