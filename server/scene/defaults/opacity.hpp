// Values of a medium -> an opacity curve through which its depth is seen
// (docs/design/rendering-model.md, "Defaults").
#pragma once

#include <array>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/model/volume.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The mean length within the box of the rays of a picture from the default viewpoint that meet it,
// world units; of a globe, twice the thickness of its shell.
double mean_chord(const Lattice& lattice);

// The mean extinction of the unmasked samples of a volume, weighted by the volumes of their cells,
// for each world unit.
double mean_extinction(const std::vector<std::array<double, 2>>& curve, const data::Volume& volume,
                       const Lattice& lattice);

// An opacity curve with which the mean ray of the default picture has an optical depth of at most
// 1, and the greatest value at most that of the style. The curve of a style that knows what is
// clear rises from there. Any other rises from the median of the values to the top of the range,
// times the mean gradient of the field where it has that value: boundaries are seen, and bodies of
// one value seen through.
std::vector<std::array<double, 2>> transparent_extinction(const ScalarStyle& style,
                                                          const protocol::Range& range,
                                                          const data::Volume& volume,
                                                          const Lattice& lattice);

}  // namespace windsplat::scene
