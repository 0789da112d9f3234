// A coarse grid of the whole earth.
#pragma once

#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {

inline std::vector<double> evenly(double first, double step, int count) {
  std::vector<double> out;
  for (int n = 0; n < count; ++n) out.push_back(first + step * n);
  return out;
}

// Longitudes 0 to 350, latitudes -80 to 80, three levels.
inline data::Grid whole_earth() {
  data::Grid grid;
  grid.axes = {axis(data::AxisKind::longitude, "degrees_east", evenly(0, 10, 36)),
               axis(data::AxisKind::latitude, "degrees_north", evenly(-80, 10, 17)),
               axis(data::AxisKind::pressure, "hPa", {1000, 500, 250})};
  return grid;
}

}  // namespace windsplat::scene
