// Which level of the data a view is drawn at, and which part of it (part_of() in scene/build.hpp):
// chosen by the sizes of cells in the picture, by memory, and by what is stored.
#pragma once

#include <cstddef>
#include <cstdint>

#include "protocol/view.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/scene/detail.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The reduction of lines.
data::Coarsening drawn(data::Coarsening how, const protocol::View& view);

// Of a field of that many components on the lattice, reduced in that way.
std::uint64_t level_bytes(const Lattice& lattice, std::size_t components,
                          const data::Coarsening& how);

// How many samples of a completed view may be merged.
MergeLimits merge_limits(const protocol::View& view);

}  // namespace windsplat::scene
