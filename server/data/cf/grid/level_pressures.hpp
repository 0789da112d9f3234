// The pressure of every level of a grid, and the resulting vertical axis.
#pragma once

#include <optional>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/grid/vertical.hpp"
#include "server/data/cf/read_blocks.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

// Source of the pressure of a sample, in Pa: fixed levels, or hybrid with surface pressure.
struct PressureLevels {
  std::vector<double> level;  // Pa, from the lowest level; empty where `hybrid` applies
  std::optional<HybridLevels> hybrid;
};

// For terrain-following levels, replaces the vertical axis with mean pressures. coordinate: the
// vertical coordinate variable, -1 if there is none. Errors: bad_data.
Result<PressureLevels> find_pressures(const ArrayFile& file, int coordinate, Placement& grid,
                                      DatasetInfo& info);

}  // namespace windsplat::data::cf
