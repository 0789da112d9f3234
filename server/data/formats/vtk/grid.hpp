// Rectilinear grids: images, rectilinear grids, and structured grids that are rectilinear. Snapshot
// -> coordinates along each world axis, and the mapping of index axes to them.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/vtk/snapshot.hpp"

namespace windsplat::data::vtk {

struct RegularGrid {
  // Coordinates along each world axis x, y, z; ascending.
  std::array<std::vector<double>, 3> coordinates;
  // For each index axis i, j, k: its world axis, and whether it is reversed.
  std::array<std::size_t, 3> world{0, 1, 2};
  std::array<bool, 3> turned{false, false, false};

  bool operator==(const RegularGrid&) const = default;
};

// The grid of an image or a rectilinear grid. Errors: bad_data, including an image whose axes are
// not parallel to those of the world, and pieces whose coordinates differ.
Result<RegularGrid> regular_grid(Files& files, const Snapshot& snapshot);

// The grid of a structured grid (points: x y z of each, i fastest) whose x, y and z depend on one
// index each; nullopt if it is curved or sheared. counts: points along i, j, k.
std::optional<RegularGrid> separable_grid(const std::vector<double>& points,
                                          const std::array<std::int64_t, 3>& counts);

// The grid of cell centres; an axis of one point is unchanged.
RegularGrid cell_centres(const RegularGrid& points);

}  // namespace windsplat::data::vtk
