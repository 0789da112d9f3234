// Checks of coordinates, common to all formats.
#pragma once

#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data {

// Why cells cannot be placed along these coordinates ("has steps below ..."); empty if they can.
// Coordinates must be finite, strictly monotonic and at most 1e290 in size, with steps of at least
// 1e-290 and at least 1e-18 of the extent, and above their rounding error. Sums, differences and
// midpoints of neighbours are then exact enough for every cell to have a positive width.
std::string axis_fault(const std::vector<double>& coordinates);

// Errors: bad_data, naming the axis.
Result<void> check_axes(const Grid& grid);

}  // namespace windsplat::data
