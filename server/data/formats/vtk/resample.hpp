// Meshes -> a uniform lattice: the cell that contains each sample, computed once.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/vtk/cells.hpp"
#include "server/data/formats/vtk/mesh.hpp"

namespace windsplat::data::vtk {

// Limits on samples along one axis and in total.
inline constexpr int lattice_axis_max = 256;

struct Resampling {
  std::array<std::vector<double>, 3> coordinates;
  // Per sample, x fastest: the cell or no_cell, and the position in it.
  std::vector<std::uint32_t> cells;
  std::vector<CellPlace> places;
  std::uint64_t inside = 0;      // samples in a cell
  std::uint64_t shown = 0;       // cells examined
  std::uint64_t broken = 0;      // cells without volume, or with hidden or non-finite points
  std::uint64_t other_rank = 0;  // surface cells in a mesh with volumes
  // Number of cells along each world axis: the number along an index for a structured grid aligned
  // with the axes, otherwise estimated from the mean extent of cells.
  std::array<double, 3> layers{0, 0, 0};
};
inline constexpr std::uint32_t no_cell = 0xffffffffU;

// The lattice covers the bounding box with uniform spacing along each axis: the mean extent of
// cells along it (for a structured grid aligned with the axes: the mean step of that index), scaled
// by one factor such that about half as many samples as points and cells together lie within cells,
// but at least 4096 (in a plane: 1024). If the extents differ by less than a quarter, all axes have
// the same spacing. Errors: bad_data, without the file name in the message.
Result<Resampling> resample(const Mesh& mesh);

// What a user should know of a resampling: sizes, and cells that are not shown.
std::vector<std::string> notes_on(const Mesh& mesh, const Resampling& where, bool of_cells);

// Computes one component on the lattice; samples outside all cells are NaN. values: one per point,
// which are interpolated, or one per cell.
void gather_points(const Mesh& mesh, const Resampling& where, const float* values, float* out);
void gather_cells(const Resampling& where, const float* values, float* out);

}  // namespace windsplat::data::vtk
