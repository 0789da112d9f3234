// A field on a lattice -> how its gradient faces the sun at each sample.
#pragma once

#include <glm/vec3.hpp>

#include "server/scene/scene.hpp"

namespace windsplat::light {

// |cos| of the angle between the gradient of the field in the world and the direction of the sun,
// which is 1 where the field is uniform: 1 - w (1 - |cos|), w = d^2 / (d^2 + 0.01^2), with d the
// change of the field over a cell relative to the range of its colours. Gradients are central
// differences, at an end or beside a masked sample one-sided ones. Computed on several threads.
scene::SampleFactors relief(const scene::Lattice& lattice, const scene::ScalarLayer& layer,
                            const glm::dvec3& sun);

}  // namespace windsplat::light
