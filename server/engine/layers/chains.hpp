// Segments of curved lines -> a pass of the plan.
#pragma once

#include "server/engine/plan.hpp"
#include "server/trace/segments.hpp"

namespace windsplat::engine {

// Segments have their own vertices and colours, and are neither moved nor clipped. `to` has the
// style of straight lines.
void chain_lines(const trace::Segments& from, kernels::LineStyle& to);

// The lattice of the vertices: sheets of 8 x n positions. Cells have no meaning. Sets everything of
// the pass that depends on the lattice except the steps and dimensions.
void place_chains(const trace::Segments& segments, PassPlan& pass);

// Removes every entry.
void clear(AxisArrays& axis);

}  // namespace windsplat::engine
