// A curved lattice of samples -> the surface at the bottom of its lowest cells.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "server/terrain/terrain.hpp"

namespace windsplat::terrain {

// As in scene::Lattice.
struct Samples {
  const std::vector<std::array<float, 3>>& places;  // world positions, x fastest
  std::array<int, 3> dims{1, 1, 1};
  std::array<double, 3> spacing{1, 1, 1};  // width of cells along an axis of one sample
  int around = 0;
};

// Half a cell below the lowest sample of every column, as far as the cells reach horizontally:
// half a cell beyond the outermost columns, unless the columns close around the globe. Not beyond a
// pole, where the columns of a row coincide.
std::shared_ptr<const Terrain> lower_boundary(const Samples& samples, Base base);

}  // namespace windsplat::terrain
