// Linear premultiplied RGBA -> encoded bytes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"

namespace windsplat::image {

using Bytes = std::vector<std::uint8_t>;

// 8-bit sRGB, 3 bytes per pixel, of the image over a linear background. Incomplete if cancelled.
Bytes tone_map(std::span<const float> rgba, int width, int height,
               const std::array<float, 3>& background, const CancelToken& cancel = {});

enum class Subsampling { s444, s420 };

// quality 1..100. Not divided into strips; input is rounded to 8 bits.
Result<Bytes> encode_jpeg(std::span<const std::uint8_t> rgb, int width, int height, int quality,
                          Subsampling subsampling);
// dots_per_inch: the size in print, as a pHYs chunk (PNG, 11.3.5.3) in whole pixels to the metre;
// without it the file tells none. Errors: cancelled, checked every few rows.
Result<Bytes> encode_png(std::span<const std::uint8_t> rgb, int width, int height,
                         const CancelToken& cancel = {}, std::optional<double> dots_per_inch = {});
// NPY 1.0, '<f4', shape (height, width, 4).
// Errors: cancelled.
Result<Bytes> encode_npy(std::span<const float> rgba, int width, int height,
                         const CancelToken& cancel = {});

}  // namespace windsplat::image
