// Media on a curved lattice -> the transmittance from the sun to each sample.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::light {

// As sunlight(), by way of a rectilinear grid around the lattice, whose cells are as wide along
// each axis as those of the lattice on average, or wider, so that it has at most twice as many
// points as the lattice has samples (but at least 32768). The extinction at a point is the sum of
// those of the samples near it, with weights that fall linearly over a cell, over the sum of the
// weights where that exceeds 1: at the edges the medium ends over a cell, with its optical depth.
// The sunlight at the points is interpolated at the samples. The errors are of first order in the
// size of the cells. A globe throws its own shadow, with a radius two cells of the grid below the
// lowest edge of the shell.
scene::SampleFactors curved_sunlight(const scene::Lattice& lattice,
                                     const std::vector<float>& extinctions, const glm::dvec3& sun,
                                     const CancelToken& cancel = {});

// Bytes of the grid while it exists.
std::uint64_t curved_working_bytes(std::uint64_t samples);

}  // namespace windsplat::light
