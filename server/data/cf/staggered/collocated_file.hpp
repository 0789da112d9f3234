// Files of models on staggered grids: every variable at the centers of cells. ArrayFile ->
// ArrayFile.
#pragma once

#include <memory>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

// The file itself if it has no staggered grid. Otherwise a file with the same variables in the same
// order, in which those on faces or corners are averages over their neighbors around each center:
//  - a sample is the mean of the two neighbors along each staggered dimension, weighted by their
//    heights where the file gives heights of numbered levels; at the end of the grid, where there
//    is one neighbor only, its value, or masked where heights weight it;
//  - variables at other heights on a shared dimension of levels are averaged or become unreadable
//    (shared_levels.hpp);
//  - a masked neighbor of a variable in units of speed is a wall and counts as 0, unless all
//    neighbors are masked; of other variables it is left out;
//  - longitudes and latitudes on faces keep their dimensions, and those of each step become those
//    of the first.
// WRF's pressure, temperature and height are added (wrf.hpp). Errors: bad_data.
Result<std::unique_ptr<ArrayFile>> collocated(std::unique_ptr<ArrayFile> file);

}  // namespace windsplat::data::cf
