// The display transfer compared with the formula of IEC 61966-2-1, and pictures over a background.
#include "server/image/tone_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "server/image/encode.hpp"

namespace windsplat::image {
namespace {

std::uint8_t code_of(float linear) {
  std::uint8_t code = 0;
  srgb_codes(&linear, &code, 1);
  return code;
}

// The curve as given by the standard, and its inverse.
double formula(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}
double inverse(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

TEST(ToneMap, KnownValuesOfTheStandard) {
  EXPECT_EQ(code_of(0.0F), 0);
  EXPECT_EQ(code_of(1.0F), 255);
  EXPECT_EQ(code_of(0.5F), 188);          // 255 * 0.735357 = 187.516
  EXPECT_EQ(code_of(0.2158605F), 128);    // #808080
  EXPECT_EQ(code_of(0.0512695F), 64);     // #404040
  EXPECT_EQ(code_of(1.0F / 3294.6F), 1);  // 12.92 * 255 codes per unit on the linear part
}

TEST(ToneMap, EveryCodeSurvivesARoundTrip) {
  for (int code = 0; code < 256; ++code) {
    EXPECT_EQ(code_of(static_cast<float>(inverse(code / 255.0))), code);
  }
}

// Half a code is the error of exact rounding.
TEST(ToneMap, RoundsToTheNearestCodeEverywhere) {
  constexpr int count = 1 << 20;
  std::vector<float> linear(count + 1);
  for (int i = 0; i <= count; ++i) linear[i] = static_cast<float>(i) / count;
  std::vector<std::uint8_t> codes(linear.size());
  srgb_codes(linear.data(), codes.data(), linear.size());
  double worst = 0;
  for (std::size_t i = 0; i < linear.size(); ++i) {
    worst = std::max(worst, std::abs(codes[i] - 255 * formula(linear[i])));
  }
  EXPECT_LE(worst, 0.5 + 1e-9);
}

TEST(ToneMap, CodeThresholdsMatchTheFormula) {
  for (int code = 0; code < 255; ++code) {
    EXPECT_EQ(code_of(static_cast<float>(inverse((code + 0.4999) / 255))), code);
    EXPECT_EQ(code_of(static_cast<float>(inverse((code + 0.5001) / 255))), code + 1);
  }
}

TEST(ToneMap, ExactFormMatchesTheFormula) {
  for (int i = 0; i <= 1000; ++i) {
    EXPECT_NEAR(srgb_from_linear(i / 1000.0), formula(i / 1000.0), 1e-12);
  }
  EXPECT_EQ(srgb_from_linear(-1), 0);
  EXPECT_EQ(srgb_from_linear(2), 1);
}

TEST(ToneMap, ValuesOutsideTheRangeAreClamped) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(code_of(-0.5F), 0);
  EXPECT_EQ(code_of(7.0F), 255);
  EXPECT_EQ(code_of(infinity), 255);
  EXPECT_EQ(code_of(-infinity), 0);
  EXPECT_EQ(code_of(std::numeric_limits<float>::quiet_NaN()), 0);
  EXPECT_EQ(code_of(std::numeric_limits<float>::denorm_min()), 0);
}

TEST(ToneMap, PremultipliedPixelsAreCompositedOverTheBackground) {
  const std::array<float, 3> background{0.2F, 0.0F, 1.0F};
  const std::vector<float> rgba{0.0F, 0.0F, 0.0F, 0.0F,   // transparent: the background
                                0.3F, 0.4F, 0.5F, 1.0F,   // opaque: unchanged
                                0.1F, 0.2F, 0.0F, 0.5F};  // half of each
  const Bytes rgb = tone_map(rgba, 3, 1, background);
  const std::vector<double> linear{0.2, 0.0, 1.0, 0.3, 0.4, 0.5, 0.2, 0.2, 0.5};
  ASSERT_EQ(rgb.size(), linear.size());
  for (std::size_t i = 0; i < linear.size(); ++i) {
    EXPECT_EQ(rgb[i], std::lround(255 * formula(linear[i]))) << i;
  }
}

// Pixels are processed in blocks: every size must process each pixel once, at its position.
TEST(ToneMap, EverySizeKeepsEveryPixelPosition) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {1, 67}, {67, 1}, {255, 1}, {256, 1}, {257, 1}, {33, 31}, {0, 5}}) {
    const int pixels = width * height;
    std::vector<float> rgba(4 * static_cast<std::size_t>(pixels), 1.0F);
    for (int i = 0; i < pixels; ++i) {
      for (int c = 0; c < 3; ++c) {
        rgba[4 * i + c] = static_cast<float>(inverse(((i * 7 + c * 31) % 256) / 255.0));
      }
    }
    const Bytes rgb = tone_map(rgba, width, height, {0, 0, 0});
    ASSERT_EQ(rgb.size(), 3 * static_cast<std::size_t>(pixels));
    for (int i = 0; i < pixels; ++i) {
      for (int c = 0; c < 3; ++c) ASSERT_EQ(rgb[3 * i + c], (i * 7 + c * 31) % 256);
    }
  }
}

}  // namespace
}  // namespace windsplat::image
