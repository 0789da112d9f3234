// Grids whose points lie on axes: images, rectilinear grids, and structured grids that turn out to
// be such. Snapshot -> coordinates along each world axis, and how indices run along them.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/vtk/snapshot.hpp"

namespace windsplat::data::vtk {

struct RegularGrid {
  // By world axis x, y, z; ascending.
  std::array<std::vector<double>, 3> coordinates;
  // By index axis i, j, k: which world axis it runs along, and whether against it.
  std::array<std::size_t, 3> world{0, 1, 2};
  std::array<bool, 3> turned{false, false, false};

  bool operator==(const RegularGrid&) const = default;
};

// Of an image or a rectilinear grid. Errors: bad_data, also for an image whose axes are not those
// of the world in any order.
Result<RegularGrid> regular_grid(const std::shared_ptr<const InputFile>& file,
                                 const Snapshot& snapshot);

// Of a structured grid (points: x y z of each, i fastest) whose x, y and z change along one index
// each; nothing if it is curved or sheared. counts: points along i, j, k.
std::optional<RegularGrid> separable_grid(const std::vector<double>& points,
                                          const std::array<std::int64_t, 3>& counts);

// The grid of the cells' centres; where there is one point, it stays.
RegularGrid cell_centres(const RegularGrid& points);

}  // namespace windsplat::data::vtk
