// Averages a volume to a coarser level; neighbours are weighted by the size of their cells.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "server/data/model/volume.hpp"

namespace windsplat::data {

// halvings[a] = h: 2^h samples along axis a are averaged to one; the last group may be smaller.
// widths[a]: cell widths along an axis, in any unit, since only ratios matter; not needed for an
// axis that is not halved.
struct Coarsening {
  std::array<int, 3> halvings{0, 0, 0};
  std::array<std::vector<double>, 3> widths;
};

// Number of samples along an axis after `halvings` halvings.
int halved(int samples, int halvings);

// Mean of the unmasked samples of each group, weighted by the volumes of their cells, per
// component; masked only if the whole group is masked. This preserves the integral of a scalar over
// space. O(samples), one pass over the source.
Volume coarsen(const Volume& fine, const Coarsening& how);

// Cache key of a coarser volume: equal keys have equal weights. Contains the normalised weights,
// rounded as in coarsen(), so it does not depend on the unit of the widths.
std::string key_of(const Coarsening& how);

}  // namespace windsplat::data
