// Colour maps: their end colours, their lightness, and colours as text.
#include "server/scene/colormap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <vector>

namespace windsplat::scene {
namespace {

// CIE relative luminance of linear sRGB.
double luminance(const std::array<float, 3>& c) {
  return 0.2126 * static_cast<double>(c[0]) + 0.7152 * static_cast<double>(c[1]) +
         0.0722 * static_cast<double>(c[2]);
}

TEST(ColorMap, EndColorsMatchThePublication) {
  const auto viridis = color_map_srgb("viridis", 256);
  EXPECT_EQ(viridis.front(), (std::array<unsigned char, 3>{0x44, 0x01, 0x54}));
  EXPECT_EQ(viridis.back(), (std::array<unsigned char, 3>{0xfd, 0xe7, 0x25}));
  const auto inferno = color_map_srgb("inferno", 2);
  EXPECT_EQ(inferno[0], (std::array<unsigned char, 3>{0x00, 0x00, 0x04}));
  EXPECT_EQ(inferno[1], (std::array<unsigned char, 3>{0xfc, 0xff, 0xa4}));
}

TEST(ColorMap, PassesThroughItsControlPoints) {
  // The eleven control points of viridis are at every tenth of 1001 entries.
  EXPECT_EQ(color_map_srgb("viridis", 11)[5], (std::array<unsigned char, 3>{0x21, 0x91, 0x8c}));
}

TEST(ColorMap, SequentialMapsGrowLighterAndDivergingOnesPeakAtTheCenter) {
  ASSERT_GE(color_maps().size(), 10U);
  for (const ColorMap& map : color_maps()) {
    const auto entries = color_map_linear(map.name, 64);
    ASSERT_EQ(entries.size(), 64U);
    std::size_t lightest = 0;
    for (std::size_t n = 1; n < entries.size(); ++n) {
      if (luminance(entries[n]) > luminance(entries[lightest])) lightest = n;
      if (map.kind == "sequential") {
        EXPECT_GT(luminance(entries[n]), luminance(entries[n - 1]) - 1e-6) << map.name << " " << n;
      }
    }
    if (map.kind == "diverging") {
      EXPECT_NEAR(static_cast<double>(lightest), 31.5, 3.0) << map.name;
    } else if (map.kind == "cyclic") {
      EXPECT_EQ(entries.front(), entries.back()) << map.name;
    } else {
      EXPECT_EQ(map.kind, "sequential");
      EXPECT_EQ(lightest, 63U) << map.name;
    }
  }
}

// OKLab (B. Ottosson 2020) of linear sRGB, by its definition.
std::array<double, 3> oklab(const std::array<float, 3>& c) {
  const double r = static_cast<double>(c[0]);
  const double g = static_cast<double>(c[1]);
  const double b = static_cast<double>(c[2]);
  const double l = std::cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const double m = std::cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const double s = std::cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return {0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
          1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
          0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s};
}

TEST(ColorMap, EqualValueDifferencesAreEqualColorDifferences) {
  for (const ColorMap& map : color_maps()) {
    if (map.kind == "cyclic") continue;  // its quarters are the quarters of the compass
    const auto entries = color_map_linear(map.name, 257);
    std::vector<double> steps;
    for (std::size_t n = 8; n < entries.size(); n += 8) {
      const auto before = oklab(entries[n - 8]);
      const auto after = oklab(entries[n]);
      steps.push_back(std::hypot(after[0] - before[0], after[1] - before[1], after[2] - before[2]));
    }
    const auto [least, most] = std::minmax_element(steps.begin(), steps.end());
    // Published maps are uniform in a different colour space (CAM02-UCS).
    const bool published =
        std::set<std::string>{"viridis", "magma", "inferno", "plasma", "cividis"}.count(map.name) !=
        0;
    EXPECT_LT(*most / *least, published ? 1.8 : 1.1) << map.name;
  }
}

TEST(ColorMap, CompassDistinguishesFourQuartersWithoutASeam) {
  const auto compass = color_map_srgb("compass", 361);
  EXPECT_EQ(compass[0], compass[360]);
  const auto distance = [&](std::size_t a, std::size_t b) {
    int sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += std::abs(int{compass[a][c]} - int{compass[b][c]});
    return sum;
  };
  for (std::size_t a = 0; a < 360; a += 90) {
    for (std::size_t b = 0; b < a; b += 90) EXPECT_GT(distance(a, b), 100) << a << " " << b;
  }
  for (std::size_t n = 0; n < 360; ++n) EXPECT_LE(distance(n, n + 1), 9) << n;
}

TEST(ColorMap, GraysAreEvenInPerceivedLightness) {
  // OKLab's lightness of a gray is the cube root of its linear value.
  const auto grays = color_map_linear("grays", 5);
  for (std::size_t n = 0; n < 5; ++n) {
    const double lightness = static_cast<double>(n) / 4.0;
    EXPECT_NEAR(static_cast<double>(grays[n][1]), lightness * lightness * lightness, 1e-5);
    EXPECT_NEAR(static_cast<double>(grays[n][0]), static_cast<double>(grays[n][2]), 1e-4);
  }
}

TEST(ColorMap, OneEntryIsTheLowEndAndUnknownNamesAreRefused) {
  EXPECT_EQ(color_map_srgb("plasma", 1)[0], (std::array<unsigned char, 3>{0x0d, 0x08, 0x87}));
  EXPECT_TRUE(has_color_map("coolwarm"));
  EXPECT_FALSE(has_color_map("jet"));
  EXPECT_FALSE(has_color_map(""));
}

TEST(Color, ParsesSixHexDigitsOnly) {
  const auto orange = parse_color("#ff8000");
  ASSERT_TRUE(orange);
  EXPECT_FLOAT_EQ((*orange)[0], 1.0F);
  EXPECT_NEAR((*orange)[1], std::pow((128.0 / 255.0 + 0.055) / 1.055, 2.4), 1e-6);
  EXPECT_FLOAT_EQ((*orange)[2], 0.0F);
  EXPECT_EQ(parse_color("#FF8000"), orange);
  for (const char* bad : {"", "ff8000", "#ff800", "#ff80000", "#ff80g0", "red"}) {
    EXPECT_FALSE(parse_color(bad)) << bad;
  }
}

TEST(Color, TransferCurveIsInvertible) {
  EXPECT_NEAR(static_cast<double>(srgb_from_linear(0.5F)), 0.735357, 1e-5);
  for (int n = 0; n <= 100; ++n) {
    const float v = static_cast<float>(n) / 100.0F;
    EXPECT_NEAR(static_cast<double>(linear_from_srgb(srgb_from_linear(v))), static_cast<double>(v),
                1e-6);
  }
}

// Ottosson's values of red: L 0.62796, a 0.22486, b 0.12585; white: L 1, a and b 0.
TEST(ColorMap, DesaturationContrastIsExceededByNineTenths) {
  const std::array<float, 3> red{1, 0, 0};
  const std::array<float, 3> grey{0.5F, 0.5F, 0.5F};
  std::vector<std::array<float, 3>> colors(10, red);
  const double contrast = std::hypot(1 - 0.62796, 0.22486, 0.12585);
  EXPECT_NEAR(desaturation_contrast(colors, 1), contrast, 1e-4);
  EXPECT_EQ(desaturation_contrast(colors, 0), 0);
  colors[7] = grey;
  EXPECT_NEAR(desaturation_contrast(colors, 1), contrast, 1e-4);
  colors[2] = grey;
  EXPECT_NEAR(desaturation_contrast(colors, 1), 0, 1e-9);
  EXPECT_EQ(desaturation_contrast({}, 1), 0);
}

}  // namespace
}  // namespace windsplat::scene
