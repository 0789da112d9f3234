// The second pass of completing a view: what follows from the data of the first step.
#pragma once

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/defaults/spacing.hpp"
#include "server/scene/place.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Of lines of a volume, slice or plane. A plane has an even lattice of its own, on which every
// sample has its line.
LineSpacing spacing_of(const protocol::GeometryView& geometry, const Lattice& lattice);

// Ranges, colours and extinctions that a view outlined by the first pass omits.
Result<void> complete_from_data(protocol::View& view, const Camera& camera, const Placed& placed,
                                data::Dataset& dataset);

}  // namespace windsplat::scene
