// Maps the tuples of a piece to sample indices of the whole grid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/data/formats/vtk/snapshot.hpp"

namespace windsplat::data::vtk {

// Sample indices of the tuples of a piece: offsets from the first sample, in the order of the
// piece. along[a]: distance between neighbours along index axis a.
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

// The target of a piece of `whole`. world: for each index axis the axis of the volume; turned:
// whether it is reversed.
Target target_of(const Extent& whole, const Extent& piece, bool of_cells,
                 const std::array<std::size_t, 3>& world, const std::array<bool, 3>& turned);

}  // namespace windsplat::data::vtk
