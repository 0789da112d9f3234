// Which coordinates an axis may have, whatever the format.
#pragma once

#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data {

// Why no cells can be laid out along these coordinates ("has steps below ..."), empty if they can:
// finite, strictly monotonic, at most 1e290 in size, and with steps that are neither below 1e-290,
// nor below 1e-18 of the axis' extent, nor lost in the rounding of the coordinates. So sums,
// differences and midpoints of neighbours are exact enough that every cell has a width above zero.
std::string axis_fault(const std::vector<double>& coordinates);

// Errors: bad_data, which names the axis.
Result<void> check_axes(const Grid& grid);

}  // namespace windsplat::data
