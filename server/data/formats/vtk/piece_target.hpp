// Maps the tuples of a piece to sample indices of the whole grid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/data/formats/vtk/snapshot.hpp"

namespace windsplat::data::vtk {

// Where the tuples of a piece go: offsets from the first sample, in the piece's order.
// along[a]: how far neighbours along index axis a lie apart.
struct Target {
  std::ptrdiff_t origin = 0;
  std::array<std::ptrdiff_t, 3> along{};
  std::array<std::int64_t, 3> counts{};

  [[nodiscard]] std::size_t at(std::uint64_t tuple) const {
    const auto t = static_cast<std::int64_t>(tuple);
    return static_cast<std::size_t>(origin + t % counts[0] * along[0] +
                                    t / counts[0] % counts[1] * along[1] +
                                    t / (counts[0] * counts[1]) * along[2]);
  }
};

// For a piece of `whole`. world: by index axis the axis of the volume; turned likewise.
Target target_of(const Extent& whole, const Extent& piece, bool of_cells,
                 const std::array<std::size_t, 3>& world, const std::array<bool, 3>& turned);

}  // namespace windsplat::data::vtk
