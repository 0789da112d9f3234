// Premultiplied linear RGBA over a linear background -> 8-bit sRGB, from a table with the exact
// rounding of the formula.
#include "server/image/tone_map.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "server/base/check.hpp"
#include "server/image/encode.hpp"

namespace windsplat::image {
namespace {

constexpr double linear_end = 0.0031308;  // the curve is linear below, with slope 12.92

double linear_from_srgb(double encoded) {
  const double linear = encoded / 12.92;
  return linear <= linear_end ? linear : std::pow((encoded + 0.055) / 1.055, 2.4);
}

// Linear values are divided into uniform bins narrower than any code (the curve is steepest at 0:
// 12.92 * 255 = 3295 codes per unit). A bin thus contains at most one border between codes, and one
// comparison selects the code.
class CodeTable {
 public:
  CodeTable() {
    for (int code = 0; code < 255; ++code) {
      const double border = linear_from_srgb((code + 0.5) / 255);
      auto above = static_cast<float>(border);
      if (above < border) above = std::nextafter(above, 2.0F);
      border_[static_cast<std::size_t>(code)] = above;
    }
    border_[255] = std::numeric_limits<float>::infinity();
    std::uint8_t code = 0;
    for (int bin = 0; bin <= bins; ++bin) {
      while (static_cast<float>(bin) / bins >= border_[code]) ++code;
      code_at_start_[static_cast<std::size_t>(bin)] = code;
    }
  }

  [[nodiscard]] std::uint8_t operator()(float linear) const {
    const float above_zero = linear > 0.0F ? linear : 0.0F;  // NaN becomes 0 too
    const float x = above_zero < 1.0F ? above_zero : 1.0F;
    const std::uint8_t code = code_at_start_[static_cast<std::uint32_t>(x * bins)];
    return static_cast<std::uint8_t>(code + static_cast<std::uint8_t>(x >= border_[code]));
  }

 private:
  static constexpr int bins = 4096;

  std::array<float, 256> border_{};  // smallest value of the next code
  std::array<std::uint8_t, bins + 1> code_at_start_{};
};

const CodeTable& code_table() {
  static const CodeTable table;
  return table;
}

constexpr std::size_t pixels_between_checks = 1U << 18;  // 1 to 2 ms

}  // namespace

double srgb_from_linear(double linear) {
  if (!(linear > 0)) return 0;
  if (linear >= 1) return 1;
  return linear <= linear_end ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

void srgb_codes(const float* linear, std::uint8_t* codes, std::size_t count) {
  const CodeTable& table = code_table();
  for (std::size_t i = 0; i < count; ++i) codes[i] = table(linear[i]);
}

Bytes tone_map(std::span<const float> rgba, int width, int height,
               const std::array<float, 3>& background, const CancelToken& cancel) {
  WINDSPLAT_CHECK(width >= 0 && height >= 0);
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  WINDSPLAT_CHECK(rgba.size() == 4 * pixels);
  const CodeTable& table = code_table();
  Bytes rgb(3 * pixels);
  const float* in = rgba.data();
  std::uint8_t* out = rgb.data();
  for (std::size_t i = 0; i < pixels; ++i, in += 4, out += 3) {
    if (i % pixels_between_checks == 0 && cancel.cancelled()) break;
    const float transmittance = 1.0F - in[3];
    out[0] = table(in[0] + transmittance * background[0]);
    out[1] = table(in[1] + transmittance * background[1]);
    out[2] = table(in[2] + transmittance * background[2]);
  }
  return rgb;
}

}  // namespace windsplat::image
