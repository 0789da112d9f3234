// A mesh -> the lattice it is resampled onto, and the cell around every sample of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/mesh/mesh.hpp"

namespace windsplat::data::cf {

// Positions along one axis of the plane, in the middle of intervals of equal length.
struct LatticeAxis {
  double first = 0;
  double spacing = 1;
  std::size_t count = 1;
  [[nodiscard]] double at(std::size_t index) const {
    return first + spacing * static_cast<double>(index);
  }
};

struct MeshLattice {
  LatticeAxis x;
  LatticeAxis y;
  bool closes = false;      // the samples along x close a circle around the globe
  double median_size = 0;   // of the cells: the square root of the area, in units of y
  bool is_coarse = false;   // the limit on samples made it coarser than the cells ask for
  std::size_t no_area = 0;  // cells left out: without area or without an outline
  [[nodiscard]] std::size_t samples() const { return x.count * y.count; }
};

inline constexpr std::uint32_t no_mesh_cell = std::numeric_limits<std::uint32_t>::max();

// Samples of a lattice: at most this many for a cell, but at least samples_of_small_mesh.
inline constexpr std::size_t samples_per_cell_max = 16;
inline constexpr std::size_t samples_of_small_mesh = 65536;

// The lattice covers the mesh with a spacing of the median cell size divided by the square root of
// two, so that cells of that size contain two samples; in degrees of longitude divided by the
// cosine of the latitude nearest to the equator. Smaller for meshes of few cells, so that 1024
// samples lie within, and larger if there were more than samples_per_cell_max for a cell, or than
// samples_max. On the
// sphere the lattice closes a circle unless a meridian crosses no cell, and the longitudes of the
// mesh are turned to lie on it. Errors: bad_data if no cell has an area.
Result<MeshLattice> lattice_of(Mesh& mesh, std::size_t samples_max);

struct CellsOfSamples {
  std::vector<std::uint32_t> cells;  // x fastest; no_mesh_cell: outside of all
  std::size_t inside = 0;            // samples
  std::size_t twice = 0;             // samples within more than one cell, which have the first
  std::size_t hit = 0;               // cells that contain a sample
};
// By scan conversion: a sample on an edge belongs to one of the two cells. Errors: bad_data if
// cells overlap so much that the work is beyond find_cells_work_max for a sample or corner.
inline constexpr std::size_t find_cells_work_max = 64;  // rows and samples visited
Result<CellsOfSamples> find_cells(const Mesh& mesh, const MeshLattice& lattice);

}  // namespace windsplat::data::cf
