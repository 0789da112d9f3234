// The arrays of a level that place its samples: times, axes, columns, the ground, widths of cells.
#pragma once

#include <string>
#include <vector>

#include "server/convert/plan.hpp"

namespace windsplat::convert {

// A name as that of a file and of an array: other characters become '_'.
std::string plain_name(const std::string& name);

struct Coordinates {
  data::zarr::WrittenArray array;  // of float64, one chunk
  std::vector<double> values;
};

// Those of coarser levels are means weighted by the widths of the cells.
std::vector<Coordinates> coordinates_of(const data::DatasetInfo& info, const Plan& plan,
                                        std::size_t level);
// The paths of all of them.
std::vector<std::string> coordinate_paths(const data::DatasetInfo& info, const Plan& plan);
// The name of the array of widths of an axis; empty: even.
std::string widths_name(const data::DatasetInfo& info, const Plan& plan, std::size_t axis);

}  // namespace windsplat::convert
