// Media on a lattice -> the transmittance from the sun to the ground.
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::light {

// The transmittance from the sun to the bottom of the box below each column of samples, x fastest.
// The optical depth is integrated along the ray that meets the ground there, up to where it leaves
// the box, with the extinction as in sunlight(): constant along z in a layer of cells, interpolated
// in x and y, and constant beyond the outermost samples. It is taken at the middle of pieces of the
// ray that are no longer than a cell along any axis (but on uneven axes than a quarter of the mean
// cell), of which there are at most 4096 in a layer: the error is of second order in the size of
// the cells. The same for any number of threads.
//
// extinctions: of extinctions(). sun: unit vector towards it, not below the horizon. The lattice
// must be rectilinear. Incomplete if cancelled.
scene::SampleFactors ground_sunlight(const scene::Lattice& lattice,
                                     const std::vector<float>& extinctions, const glm::dvec3& sun,
                                     const CancelToken& cancel = {});

}  // namespace windsplat::light
