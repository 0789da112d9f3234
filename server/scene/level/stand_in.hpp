// What is drawn of a level while what a view wants of the data is not resident, and what is loaded
// meanwhile (docs/design/bricks.md).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "server/data/resident/dataset.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/level/parts.hpp"

namespace windsplat::scene {

// Whether coarser data may be drawn in place of those that are not resident.
enum class StandIn { none, allowed };

struct Substitute {
  DrawnPart part;
  std::uint64_t missing_bytes = 0;  // of what is wanted and not resident; 0: it has the same level
};

// The finest that is resident and holds what is in sight, not finer than `wanted`: a part or the
// whole of a stored level, of all fields at the step of the view. nullopt: `wanted` itself is
// resident, or nothing can stand in for it.
std::optional<Substitute> stand_in_for(const CompletedView& completed, const DrawnPart& wanted,
                                       const data::Dataset& dataset);

// The finest whole level that takes little of the memory limit, resident or not: what is drawn
// first where nothing is resident. nullopt: what is wanted is, or there is no such level.
std::optional<Substitute> base_for(const CompletedView& completed, const DrawnPart& wanted,
                                   const data::Dataset& dataset);

// What is loaded while a view moves, in this order: the finest whole level that takes little of the
// memory limit, which always stands in, and what is drawn once it is resident. Empty: nothing
// stands in for it.
std::vector<Needed> loads_of(const CompletedView& completed, const data::Dataset& dataset);

}  // namespace windsplat::scene
