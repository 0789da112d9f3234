// Positions of a DX field -> where each index runs in the world.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/dx/library.hpp"

namespace windsplat::data::dx {

struct GridAxis {
  std::size_t place = 0;            // which component of a position grows: 0 x, 1 y, 2 z
  std::vector<double> coordinates;  // of that component
  bool operator==(const GridAxis&) const = default;
};

struct Grid {
  std::vector<GridAxis> axes;  // slowest index first, as in the file
  bool oblique = false;        // drawn along the nearest straight axes
  bool y_up = false;           // the second component of positions is vertical
  bool operator==(const Grid&) const = default;
};

// The world axis (0 x, 1 y, 2 z) of a component of positions or of vectors. With y up the three
// turn in a circle (z, x, y), which keeps the picture from being mirrored.
std::size_t world_of(const Grid& grid, std::size_t place);

// Positions as a regular grid or as a product of lines; others are refused. Errors: bad_data.
// `items`: how many values stand on it, which bounds the counts.
Result<Grid> grid_of(Library& library, const Found& positions, std::uint64_t items);

// The same grid by the middles of its cells: what depends on connections lies there.
Grid middles(const Grid& grid);

}  // namespace windsplat::data::dx
