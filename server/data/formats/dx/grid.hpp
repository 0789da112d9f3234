// Positions of a DX field -> the world axis and coordinates of each index.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/dx/library.hpp"

namespace windsplat::data::dx {

struct GridAxis {
  std::size_t place = 0;            // component of positions that varies: 0 x, 1 y, 2 z
  std::vector<double> coordinates;  // coordinates of that component
  bool operator==(const GridAxis&) const = default;
};

struct Grid {
  std::vector<GridAxis> axes;  // slowest index first, as in the file
  bool oblique = false;        // approximated by the nearest coordinate axes
  bool y_up = false;           // the second component of positions is vertical
  bool operator==(const Grid&) const = default;
};

// The world axis (0 x, 1 y, 2 z) of a component of positions or vectors. With y up the axes are
// permuted cyclically (z, x, y), which preserves handedness.
std::size_t world_of(const Grid& grid, std::size_t place);

// Accepts positions as a regular grid or as a product of lines. `items`: number of values, which
// bounds the counts. Errors: bad_data.
Result<Grid> grid_of(Library& library, const Found& positions, std::uint64_t items);

// The grid of cell centres, for data that depend on connections.
Grid middles(const Grid& grid);

}  // namespace windsplat::data::dx
