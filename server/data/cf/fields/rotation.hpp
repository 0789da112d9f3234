// Winds told by east and north, on grids whose own axes run otherwise: longitudes and latitudes of
// the columns in, components along the axes out.
#pragma once

#include <cstddef>
#include <vector>

#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

// One a column: where the x axis points on the ground. The y axis is at right angles to it; it is
// to the left, or to the right where the grid is seen from below (side = -1).
struct GridBearing {
  std::vector<float> east;  // of the x axis' unit vector
  std::vector<float> north;
  float side = 1;
};

// width: columns along x. By the neighbours on the sphere; where the axes are not at right angles,
// the mean of what both say.
GridBearing bearing_of(const Columns& columns, std::size_t width);

// Components east and north become those along x and y, in place; `levels` layers of both.
void rotate(const GridBearing& bearing, std::size_t levels, float* east, float* north);

}  // namespace windsplat::data::cf
