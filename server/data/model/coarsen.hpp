// A volume at a coarser level: neighbours averaged by the size of their cells. Volume -> Volume.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "server/data/model/volume.hpp"

namespace windsplat::data {

// halvings[a] = h: 2^h samples along axis a become one, the last one of those that are left.
// widths[a]: of the fine cells along an axis, in any unit; only their ratios count. An axis that is
// not halved needs none.
struct Coarsening {
  std::array<int, 3> halvings{0, 0, 0};
  std::array<std::vector<double>, 3> widths;
};

// Samples along an axis after it was halved so often.
int halved(int samples, int halvings);

// Mean of each group's unmasked samples, weighted by the volumes of their cells, component by
// component; masked only where all of the group is. So a scalar keeps its integral over space.
// O(samples), one pass over the source.
Volume coarsen(const Volume& fine, const Coarsening& how);

// Same text, same weights: what a coarser volume is kept under. Of widths it holds each one's share
// of its group, rounded as coarsen() has it, so the unit that they are in does not matter.
std::string key_of(const Coarsening& how);

}  // namespace windsplat::data
