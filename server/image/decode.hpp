// JPEG bytes -> 8-bit sRGB, to measure the encoding error.
#pragma once

#include <cstdint>
#include <span>

#include "server/base/error.hpp"
#include "server/image/encode.hpp"
#include "server/image/ycc.hpp"

namespace windsplat::image {

// 3 bytes per pixel. Errors: bad_data (not a JPEG, or not of this size).
Result<Bytes> decode_jpeg(std::span<const std::uint8_t> jpeg, int width, int height);

// RMSE over linear R, G and B between the YCbCr codes of the picture and the pixels of its JPEG.
// Does not include the error of chroma subsampling. Errors: bad_data.
Result<double> encoding_error(const YccPicture& picture, std::span<const std::uint8_t> jpeg);

}  // namespace windsplat::image
