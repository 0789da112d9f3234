// Volumes in half the memory: 16 bits per value, quantised linearly between the least and greatest
// value of each component. Volume -> PackedVolume -> Volume.
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
    float step = 0;  // quantisation step in the units of the component; 0 if all values are equal
  };
  std::array<int, 3> dims{};
  int components = 1;
  std::array<Component, 3> scale{};
  std::vector<std::uint16_t> codes;  // value = low + step * code; 65535: masked
  std::array<float, 2> range{0, 0};  // those of the original volume
  std::int64_t masked = 0;

  [[nodiscard]] std::size_t bytes() const { return codes.size() * sizeof(std::uint16_t); }
  // The largest difference between packed and original values of a component, except for arithmetic
  // rounding (2^-23 of the value): half a step.
  [[nodiscard]] float error(int component) const;
};

// nullopt if the range of values is so large that steps could exceed the range of float.
std::optional<PackedVolume> pack(const Volume& volume);
Volume unpack(const PackedVolume& packed);

}  // namespace windsplat::data
