#include "server/data/formats/vtk/piece_target.hpp"

#include <algorithm>

namespace windsplat::data::vtk {

Target target_of(const Extent& whole, const Extent& piece, bool of_cells,
                 const std::array<std::size_t, 3>& world, const std::array<bool, 3>& turned) {
  const auto all = of_cells ? whole.cells() : whole.points();
  Target out;
  out.counts = of_cells ? piece.cells() : piece.points();
  std::array<std::int64_t, 3> dims{};
  for (std::size_t a = 0; a < 3; ++a) dims.at(world[a]) = all[a];
  const std::array<std::int64_t, 3> stride{1, dims[0], dims[0] * dims[1]};
  for (std::size_t a = 0; a < 3; ++a) {
    // A piece of one layer of points at the end has its cells in the last layer.
    const std::int64_t first = std::min(piece.first[a] - whole.first[a], all[a] - out.counts[a]);
    const std::int64_t step = stride.at(world[a]);
    out.along[a] = turned[a] ? -step : step;
    out.origin += turned[a] ? (all[a] - 1 - first) * step : first * step;
  }
  return out;
}

}  // namespace windsplat::data::vtk
