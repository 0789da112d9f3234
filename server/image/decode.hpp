// JPEG bytes -> 8-bit sRGB, for measuring what an encoding costs.
#pragma once

#include <cstdint>
#include <span>

#include "server/base/error.hpp"
#include "server/image/encode.hpp"
#include "server/image/ycc.hpp"

namespace windsplat::image {

// 3 bytes a pixel, of a JPEG of that size. Errors: bad_data (no JPEG, or of another size).
Result<Bytes> decode_jpeg(std::span<const std::uint8_t> jpeg, int width, int height);

// What coding the picture cost: RMSE over linear R, G and B between its codes and the JPEG's
// pixels. Chroma that the picture has halved already does not count. Errors: bad_data.
Result<double> encoding_error(const YccPicture& picture, std::span<const std::uint8_t> jpeg);

}  // namespace windsplat::image
