// IEEE 754 binary16 -> float, double.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace windsplat::data::zarr {

struct Half {
  std::uint16_t bits;

  explicit operator float() const {
    const int exponent = (bits >> 10U) & 0x1f;
    const auto fraction = static_cast<float>(bits & 0x3ffU);
    float value = 0;
    if (exponent == 31) {
      value = fraction != 0 ? std::numeric_limits<float>::quiet_NaN()
                            : std::numeric_limits<float>::infinity();
    } else if (exponent == 0) {
      value = std::ldexp(fraction, -24);
    } else {
      value = std::ldexp(fraction + 1024, exponent - 25);
    }
    return (bits & 0x8000U) != 0 ? -value : value;
  }
  explicit operator double() const { return static_cast<double>(static_cast<float>(*this)); }
};

}  // namespace windsplat::data::zarr
