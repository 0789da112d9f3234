// The height of the ground or the sea floor that a file gives for the columns of its grid.
#pragma once

#include "server/data/cf/array_file.hpp"
#include "server/data/cf/grid/level_heights.hpp"
#include "server/data/cf/read_blocks.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

// Sets info.grid.ground from a variable of the columns: by its standard name, as `orog` or `depth`
// of the formula of the levels (`heights`), or by a usual name, with a unit of length or, for a
// geopotential at the surface, of energy. Values that depend on time must be those of the first
// step at the second and the last one too. A variable that is recognised but not used is named by a
// note with the reason; none fails the dataset. Does nothing for grids of one level.
void find_ground(const ArrayFile& file, const LevelHeights& heights, const Placement& grid,
                 DatasetInfo& info);

}  // namespace windsplat::data::cf
