// Media on a lattice -> the transmittance from the sun to each sample.
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::light {

// The extinction of all media at the samples of a lattice, per world unit, times a factor, x
// fastest; of a medium with a stride each sample has that of its kernel. Computed on several
// threads.
// Incomplete if cancelled.
std::vector<float> extinctions(const scene::Lattice& lattice,
                               const std::vector<scene::ScalarLayer>& media, double factor = 1,
                               const CancelToken& cancel = {});

// For each sample the mean of the transmittances from the sun to the two places where the ray
// through the sample enters and leaves its layer of cells, the layers being those across the axis
// of which the ray passes most. In a thin medium this is the transmittance at the sample to second
// order in the optical depth of a cell. Where a cell is opaque it is 1/2 for one that the sun
// shines on, which is the light that an opaque homogeneous medium scatters back to the sun, rather
// than the darkness in its middle.
//
// The optical depth is integrated along parallel rays through the lattice, with the extinction
// interpolated in each layer, and only its result is interpolated at the samples: the error is of
// second order in the size of the cells, except within a cell of the faces of the box through which
// rays enter and of where those that enter through two of them meet, where it is of first order. On
// an uneven axis the rays lie as close as its narrowest cells, but at least a quarter of the mean
// cell apart. The same for any number of threads.
//
// sun: unit vector towards it. The lattice must be rectilinear. Incomplete if cancelled.
scene::SampleFactors sunlight(const scene::Lattice& lattice, const std::vector<float>& extinctions,
                              const glm::dvec3& sun, const CancelToken& cancel = {});

// The axis across which the layers of sunlight() lie.
int layer_axis(const scene::Lattice& lattice, const glm::dvec3& sun);

}  // namespace windsplat::light
