// Coordinates that count columns and rows although their units are those of longitudes and
// latitudes. ArrayFile -> ArrayFile.
#pragma once

#include <memory>

#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

// The file itself if it has none. Otherwise the same variables in the same order, in which two 1-D
// coordinates in degrees east and north that are exactly 1, 2, ... N on the dimensions of a common
// variable are unread: 2-D longitudes and latitudes place these columns and rows, or their indices.
// A grid of one degree from (1, 1) is told from that: its dimensions do not have the names of FV3
// (grid_xt, grid_yt, grid_x, grid_y), which stores tiles of cubed spheres so, it has no 2-D
// positions, and its latitudes end at the pole.
std::unique_ptr<ArrayFile> without_index_axes(std::unique_ptr<ArrayFile> file);

}  // namespace windsplat::data::cf
