// The columns of samples -> the surface of the ground: given heights, or the bottom of the lowest
// cells.
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
  // Of every column the height of the ground, world z or, on a globe, the radius; NaN: open. Null:
  // the bottom of the lowest cells.
  const std::vector<double>* ground = nullptr;
  // Of every column the level of its lowest sample; -1: it has none and is open. Null: 0.
  const std::vector<int>* lowest = nullptr;
};

// At the heights of the ground, or half a cell below the lowest sample of every column, as far as
// the cells reach horizontally: half a cell beyond the outermost columns, unless the columns close
// around the globe. Not beyond a pole, where the columns of a row coincide. Open columns are
// missing vertices.
std::shared_ptr<const Terrain> surface_of(const Samples& samples, Base base);

}  // namespace windsplat::terrain
