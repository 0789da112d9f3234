// Comparison of encoded and decoded pixels in linear light.
#include <algorithm>
#include <array>
#include <cmath>

#include "server/image/decode.hpp"

namespace windsplat::image {
namespace {

// An 8-bit sRGB code -> linear light in [0, 1] (IEC 61966-2-1).
std::array<float, 256> linear_codes() {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double value = static_cast<double>(i) / 255;
    table[i] = static_cast<float>(value <= 0.04045 ? value / 12.92
                                                   : std::pow((value + 0.055) / 1.055, 2.4));
  }
  return table;
}

std::size_t code_of(float value) {
  return static_cast<std::size_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
}

}  // namespace

Result<double> encoding_error(const YccPicture& picture, std::span<const std::uint8_t> jpeg) {
  const int width = picture.width();
  const int height = picture.height();
  const auto decoded = decode_jpeg(jpeg, width, height);
  if (!decoded) return decoded.error();
  const std::array<float, 256> linear = linear_codes();
  const auto& planes = picture.planes();
  const int scale = picture.subsampling() == Subsampling::s420 ? 2 : 1;
  double squares = 0;
  for (int y = 0; y < height; ++y) {
    const auto row = [&](std::size_t plane, int line) {
      return planes[plane].samples + static_cast<std::ptrdiff_t>(line) * planes[plane].width;
    };
    const std::uint8_t* const luma = row(0, y);
    const std::uint8_t* const blue = row(1, y / scale);
    const std::uint8_t* const red = row(2, y / scale);
    const std::uint8_t* out = decoded->data() + static_cast<std::size_t>(y) * 3 * width;
    float sum = 0;
    for (int x = 0; x < width; ++x, out += 3) {
      const int chroma = x / scale;
      const auto light = static_cast<float>(luma[x]);
      const float cb = static_cast<float>(blue[chroma]) - 128;
      const float cr = static_cast<float>(red[chroma]) - 128;
      const std::array<float, 3> rgb{light + 1.402F * cr, light - 0.344136F * cb - 0.714136F * cr,
                                     light + 1.772F * cb};
      for (std::size_t c = 0; c < 3; ++c) {
        const float apart = linear[code_of(rgb[c])] - linear[out[c]];
        sum += apart * apart;
      }
    }
    squares += sum;
  }
  return std::sqrt(squares / (3.0 * width * height));
}

}  // namespace windsplat::image
