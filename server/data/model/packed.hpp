// Volumes in half the memory: 16 bits a value, even steps between a component's least and greatest
// value. Volume -> PackedVolume -> Volume.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/data/model/volume.hpp"

namespace windsplat::data {

struct PackedVolume {
  struct Component {
    float low = 0;
    float step = 0;  // in the component's units; 0 where all values are one
  };
  std::array<int, 3> dims{};
  int components = 1;
  std::array<Component, 3> scale{};
  std::vector<std::uint16_t> codes;  // value = low + step * code; 65535 is masked
  std::array<float, 2> range{0, 0};  // those of the volume that was packed
  std::int64_t masked = 0;

  [[nodiscard]] std::size_t bytes() const { return codes.size() * sizeof(std::uint16_t); }
  // The most that a value of a component may differ from what was packed, but for the rounding of
  // the arithmetic (2^-23 of the value): half a step.
  [[nodiscard]] float error(int component) const;
};

// Nothing where values lie so far apart that their steps could leave the range of a float.
std::optional<PackedVolume> pack(const Volume& volume);
Volume unpack(const PackedVolume& packed);

}  // namespace windsplat::data
