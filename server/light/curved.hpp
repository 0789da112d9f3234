// Media on a curved lattice -> the transmittance from the sun to each sample.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::light {

// As sunlight(), by way of a rectilinear grid around the lattice, whose cells are as wide along
// each axis as those of the lattice on average, or wider, so that it has at most twice as many
// points as the lattice has samples (but at least 32768). The extinction at a point is the sum of
// those of the samples near it, with weights that fall linearly over a cell of the lattice, or over
// one of the grid and are less by as much where that is wider, over the sum of the weights where
// that exceeds 1: at the edges the medium ends over a cell, with its optical depth. The sunlight at
// the points is interpolated at the samples. The errors are of first order in the size of the
// cells. A globe throws its own shadow, with a radius two cells of the grid below the lowest edge
// of the shell.
//
// The three steps of it follow.
scene::SampleFactors curved_sunlight(const scene::Lattice& lattice,
                                     const std::vector<float>& extinctions, const glm::dvec3& sun,
                                     const CancelToken& cancel = {});

// The grid: only dims, positions, spacing and box are set. Of one cell if cancelled.
scene::Lattice grid_around(const scene::Lattice& lattice, const CancelToken& cancel = {});
// The same from its dims, its first point and the size of its cells.
scene::Lattice even_grid(const std::array<int, 3>& dims, const glm::dvec3& first,
                         const glm::dvec3& cell);
// The transmittance at the points of the grid.
scene::SampleFactors grid_sunlight(const scene::Lattice& lattice,
                                   const std::vector<float>& extinctions,
                                   const scene::Lattice& grid, const glm::dvec3& sun,
                                   const CancelToken& cancel = {});
// Interpolated at the samples.
scene::SampleFactors sunlight_at_samples(const scene::Lattice& lattice, const scene::Lattice& grid,
                                         const scene::SampleFactors& points);

// How much further along the rays than the ground the transmittance at points is that of all media
// before the ground, in world units: beyond what these are spread over below their lowest edge. A
// cell of the grid; on a globe, which is opaque further down, half of one.
double below_ground(const scene::Lattice& lattice, const scene::Lattice& grid,
                    const glm::dvec3& sun);

// Bytes of the grid while it exists.
std::uint64_t curved_working_bytes(std::uint64_t samples);

}  // namespace windsplat::light
