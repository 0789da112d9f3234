// The display transfer of sRGB (IEC 61966-2-1): the exact curve, and the fast one that pictures
// use.
#pragma once

#include <cstddef>
#include <cstdint>

namespace windsplat::image {

// Encoded value in [0, 1] of a linear one; clamped, NaN is 0.
double srgb_from_linear(double linear);

// round(255 srgb_from_linear(x)) of `count` values, from a table: the same codes as the formula's.
void srgb_codes(const float* linear, std::uint8_t* codes, std::size_t count);

}  // namespace windsplat::image
