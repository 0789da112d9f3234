// Rows of linear pixels -> YCbCr codes, with SIMD in the width of the processor.
#pragma once

#include <array>
#include <cstdint>

namespace windsplat::image {

constexpr int row_pixels = 64;  // converted together

using RowCodes = std::array<std::uint8_t, row_pixels>;

struct Background {
  std::array<float, 3> linear{};
  std::array<float, 3> value{};  // sRGB, 0..255
};
Background background_of(const std::array<float, 3>& linear);

struct YccRow {
  alignas(64) RowCodes luma;
  alignas(64) RowCodes blue;
  alignas(64) RowCodes red;
};

// `rgba`: row_pixels linear premultiplied pixels, put over the background.
void convert_row(const float* rgba, const Background& background, YccRow& codes);

// Converts two rows; the chroma of 2 x 2 pixels is that of their mean sRGB value. Only the first
// half of the chroma arrays is used.
struct YccPair {
  alignas(64) RowCodes upper;
  alignas(64) RowCodes lower;
  alignas(64) RowCodes blue;
  alignas(64) RowCodes red;
};
void convert_pair(const float* upper, const float* lower, const Background& background,
                  YccPair& codes);

}  // namespace windsplat::image
