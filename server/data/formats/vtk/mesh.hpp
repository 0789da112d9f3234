// Points and cells of grids of any kind, in memory. Snapshot -> checked indices.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/vtk/cells.hpp"
#include "server/data/formats/vtk/snapshot.hpp"

namespace windsplat::data::vtk {

struct Mesh {
  std::vector<double> points;  // x y z of each; NaN if a point is hidden or missing
  // Structured: points along i, j, k, cells in the same order. All zero: unstructured.
  std::array<std::int64_t, 3> counts{0, 0, 0};
  std::vector<bool> hidden;  // structured: cells not shown; empty: none
  // Unstructured: one per cell; Shape::none is skipped. Indices begin at `first` in `corners`.
  std::vector<Shape> shapes;
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> corners;
  std::map<int, std::uint64_t> unread;  // number of skipped cells by VTK type

  [[nodiscard]] std::uint64_t point_count() const { return points_read; }
  [[nodiscard]] std::uint64_t cell_count() const;
  // The shape of a cell, and the points of its corners.
  Shape cell(std::uint64_t index, std::array<std::uint32_t, 8>& out) const;
  // Frees data that are only needed to locate positions in cells.
  void forget_points();

  std::uint64_t points_read = 0;
};

// The shape of a cell type of VTK; Shape::none if it is not supported.
Shape shape_of_type(int type);

// Errors: bad_data.
Result<Mesh> read_mesh(Files& files, const Snapshot& snapshot);

// A digest of points and cells; call it before forget_points().
std::string digest_of_mesh(const Mesh& mesh);

// The ghost array of the point or cell data of a piece, as values of vtkGhostType; empty if absent.
Result<std::vector<double>> read_ghosts(const std::shared_ptr<const InputFile>& file,
                                        const std::vector<StoredArray>& arrays);
// Whether a value of the ghost array has any of these bits.
bool has_bit(double ghost, unsigned bits);

// Maps the points (of_cells: cells) of a piece to the whole: calls row(i j k in the whole, count)
// for each row along i, in the order of the piece. Errors: those of row.
template <class Row>
Result<void> for_rows(const Extent& whole, const Extent& piece, bool of_cells, const Row& row) {
  const auto all = of_cells ? whole.cells() : whole.points();
  const auto part = of_cells ? piece.cells() : piece.points();
  std::array<std::int64_t, 3> from{};
  for (std::size_t a = 0; a < 3; ++a) {
    // A piece of one layer of points at the end of the whole has no cells of its own.
    from[a] = std::min(piece.first[a] - whole.first[a], all[a] - part[a]);
  }
  for (std::int64_t k = 0; k < part[2]; ++k) {
    for (std::int64_t j = 0; j < part[1]; ++j) {
      const std::array<std::int64_t, 3> at{from[0], from[1] + j, from[2] + k};
      if (auto done = row(at, static_cast<std::size_t>(part[0])); !done) return done;
    }
  }
  return {};
}

// Number of points (of_cells: cells) of the whole in no piece. Not for unstructured grids.
std::uint64_t uncovered(const Snapshot& snapshot, bool of_cells);

}  // namespace windsplat::data::vtk
