// JPEG bytes -> 8-bit sRGB, for measuring what an encoding costs.
#pragma once

#include <cstdint>
#include <span>

#include "server/base/error.hpp"
#include "server/image/encode.hpp"

namespace windsplat::image {

// 3 bytes a pixel, of a JPEG of that size. Errors: bad_data (no JPEG, or of another size).
Result<Bytes> decode_jpeg(std::span<const std::uint8_t> jpeg, int width, int height);

}  // namespace windsplat::image
