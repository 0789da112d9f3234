// View and layer -> the flow that lines follow, and their colours.
#pragma once

#include <glm/vec3.hpp>

#include "server/scene/scene.hpp"
#include "server/trace/flow.hpp"

namespace windsplat::scene {

// The smallest magnitude that the kernels draw, whatever the least of the view.
constexpr double drawn_least = 0x1p-124;

// Of the vectors of a layer as they are drawn; a view of the layer and the lattice.
trace::Flow flow_of(const VectorLayer& layer, const Lattice& lattice);

// The value of a place that determines its colour; see trace::Segments::colors.
double color_value(const VectorLayer& layer, const Lattice& lattice, const trace::Flow& flow,
                   const glm::dvec3& index, const trace::Motion& motion);

}  // namespace windsplat::scene
