// Meshes of any shape -> an even lattice: the cell containing each sample, found once.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/vtk/cells.hpp"
#include "server/data/formats/vtk/mesh.hpp"

namespace windsplat::data::vtk {

// Samples along one axis and in all, at most.
inline constexpr int lattice_axis_max = 256;

struct Resampling {
  std::array<std::vector<double>, 3> coordinates;
  // One a sample, x fastest: the cell, or no_cell; and where in it.
  std::vector<std::uint32_t> cells;
  std::vector<CellPlace> places;
  std::uint64_t inside = 0;      // samples in a cell
  std::uint64_t shown = 0;       // cells that were looked through
  std::uint64_t broken = 0;      // cells without a volume, or with points hidden or not finite
  std::uint64_t other_rank = 0;  // surfaces where there are volumes
  // By world axis, how many cells stand one behind the other: of a structured grid whose indices
  // run along the axes its own number, otherwise from the cells' mean extent.
  std::array<double, 3> layers{0, 0, 0};
};
inline constexpr std::uint32_t no_cell = 0xffffffffU;

// The lattice fills the bounding box with even spacing along each axis: the cells' mean extent
// along it (of a structured grid whose indices run along the axes: the mean step of that index),
// all scaled by one factor, so that within the cells lie about half as many samples as there are
// points and cells together, but at least 4096 (in a plane: 1024). Cells whose extents differ by
// less than a quarter get one spacing. Errors: bad_data, the message without the file's name.
Result<Resampling> resample(const Mesh& mesh);

// One component on the lattice; samples outside all cells are NaN. values: one a point, which are
// interpolated, or one a cell.
void gather_points(const Mesh& mesh, const Resampling& where, const float* values, float* out);
void gather_cells(const Resampling& where, const float* values, float* out);

}  // namespace windsplat::data::vtk
