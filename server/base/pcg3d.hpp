// pcg3d of Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 2020: three integers ->
// three uncorrelated 32-bit values.
#pragma once

#include <array>
#include <cstdint>

namespace windsplat {

inline std::array<std::uint32_t, 3> pcg3d(std::array<std::uint32_t, 3> v) {
  for (std::uint32_t& c : v) c = c * 1664525U + 1013904223U;
  for (int round = 0; round < 2; ++round) {
    v[0] += v[1] * v[2];
    v[1] += v[2] * v[0];
    v[2] += v[0] * v[1];
    if (round > 0) break;
    for (std::uint32_t& c : v) c ^= c >> 16U;
  }
  return v;
}

}  // namespace windsplat
