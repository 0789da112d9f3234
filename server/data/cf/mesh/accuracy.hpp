// How well a lattice shows a mesh: the error of a known function.
#pragma once

#include "server/data/cf/mesh/lattice.hpp"
#include "server/data/cf/mesh/mesh.hpp"
#include "server/data/cf/mesh/weights.hpp"

namespace windsplat::data::cf {

// Length of the wave in median cell sizes, and the cells in which its error is measured.
inline constexpr double test_wave_cells = 8;
inline constexpr double test_cell_size_max = 1.5;  // times the median

// The rms error, as a share of the rms of the wave, with which the weights reproduce a sum of plane
// waves of that length from its values at the centroids of cells or at nodes. Measured at up to
// 20,000 samples in cells of up to test_cell_size_max; NaN if there are none.
double error_of_wave(const Mesh& mesh, const MeshLattice& lattice, MeshWeights& weights,
                     MeshLocation location);

}  // namespace windsplat::data::cf
