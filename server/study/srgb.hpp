// An 8-bit sRGB code -> linear light in [0, 1] (IEC 61966-2-1).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace windsplat::study {

inline double linear_from_code(std::uint8_t code) {
  static const std::array<double, 256> table = [] {
    std::array<double, 256> made{};
    for (std::size_t i = 0; i < made.size(); ++i) {
      const double encoded = static_cast<double>(i) / 255;
      made[i] = encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
    }
    return made;
  }();
  return table[code];
}

}  // namespace windsplat::study
