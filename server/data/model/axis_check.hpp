// Checks of coordinates, common to all formats.
#pragma once

#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data {

// Why cells cannot be placed along these coordinates ("has coordinates closer than ..."); empty if
// they can. Coordinates must be finite, strictly monotonic and at most 1e290 in magnitude, and
// neighbours must be at least 1e-290, 1e-18 of the extent and their rounding error apart. Sums,
// differences and midpoints of neighbours are then exact enough for every cell to have a positive
// width.
std::string axis_fault(const std::vector<double>& coordinates);

// Errors: bad_data, naming the axis.
Result<void> check_axes(const Grid& grid);

}  // namespace windsplat::data
