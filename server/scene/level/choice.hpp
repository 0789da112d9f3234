// Which level of the data a view is drawn at, and which part of it (part_of() in scene/build.hpp):
// chosen by the sizes of cells in the picture, by memory, and by what is stored.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/detail.hpp"
#include "server/scene/level/parts.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The reduction of lines.
data::Coarsening drawn(data::Coarsening how, const protocol::View& view);

// Of a field of that many components on the lattice, reduced in that way.
std::uint64_t level_bytes(const Lattice& lattice, std::size_t components,
                          const data::Coarsening& how);

// Vectors whose level is reduced in that way: at full detail of strided lines the middles of their
// kernels, where these are stored and nothing else needs the samples between them.
ShownField lines_at(const protocol::View& view, const data::Coarsening& how, const Lattice& lattice,
                    const data::Dataset& dataset);

// The fields that a view shows, reduced in that way.
std::vector<ShownField> shown_at(const protocol::View& view, const data::Coarsening& how,
                                 const Lattice& lattice, const data::Dataset& dataset);

// Whether what is stored of a level, or of a part of the samples, may be drawn of the view: not of
// what shows the samples of the whole themselves, as slices and streamlets do, or what a region
// keeps of them.
bool may_use_stored(const protocol::View& view, const Lattice& lattice,
                    const data::Dataset& dataset);

// Whether merged samples may be drawn in place of those of the data. The reference draws none, and
// strided media do not.
bool may_merge(const protocol::View& view);

// How many samples of a completed view may be merged.
MergeLimits merge_limits(const protocol::View& view);

}  // namespace windsplat::scene
