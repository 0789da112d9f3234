// Rotates vectors with components along east and north to the axes of the grid, computed from
// longitudes and latitudes of its columns.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

// Direction of the x axis at each column. The y axis is perpendicular to it, on the left, or on the
// right for a left-handed grid (side = -1).
struct GridBearing {
  std::vector<float> east;  // components of the unit vector along x
  std::vector<float> north;
  float side = 1;
};

// width: columns along x. Computed from neighbours on the sphere; if the axes are not
// perpendicular, the mean direction of both.
GridBearing bearing_of(const Columns& columns, std::size_t width);

// Of a column: the directions of the x and y axes as unit vectors along east and north.
struct AxisTangents {
  std::vector<std::array<float, 2>> x;
  std::vector<std::array<float, 2>> y;
};
GridBearing bearing_of(const AxisTangents& tangents);

// Converts components along east and north to those along x and y in place, for `levels` layers.
void rotate(const GridBearing& bearing, std::size_t levels, float* east, float* north);

}  // namespace windsplat::data::cf
