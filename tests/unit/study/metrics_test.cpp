// Errors in linear light compared with manual sums, and FLIP by its known properties.
#include "server/study/metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "server/frame/difference.hpp"

namespace windsplat::study {
namespace {

using Rgb = std::vector<std::uint8_t>;

constexpr int side = 48;

Rgb filled(std::uint8_t r, std::uint8_t g, std::uint8_t b) {
  Rgb rgb;
  for (int i = 0; i < side * side; ++i) rgb.insert(rgb.end(), {r, g, b});
  return rgb;
}

double flip(const Rgb& a, const Rgb& b) { return mean_flip(a, b, side, side); }

Rgb noisy(const Rgb& from, double sigma) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, sigma);
  Rgb out = from;
  for (auto& v : out) {
    v = static_cast<std::uint8_t>(std::clamp(std::round(v + normal(random)), 0.0, 255.0));
  }
  return out;
}

TEST(Difference, ContainsRootMeanSquareMaximumAndDecibels) {
  const std::vector<float> picture{0.5F, 0, 0, 1, 0, 0, 0, 0};
  const std::vector<double> truth{0.25, 0, 0, 1, 0, 0.5, 0, 0};
  const frame::Difference d = frame::difference_of(picture, truth);
  EXPECT_NEAR(d.rmse, std::sqrt((0.0625 + 0.25) / 8), 1e-15);
  EXPECT_DOUBLE_EQ(d.max, 0.5);
  EXPECT_NEAR(d.psnr, 10 * std::log10(8 / 0.3125), 1e-12);
}

TEST(Difference, EqualPicturesGiveZeroAndNanIsUnknown) {
  std::vector<float> picture{0.5F, 0, 0, 1};
  const std::vector<double> truth(picture.begin(), picture.end());
  EXPECT_EQ(frame::difference_of(picture, truth).rmse, 0);
  EXPECT_EQ(frame::difference_of(picture, truth).psnr, std::numeric_limits<double>::infinity());
  picture[1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(std::isnan(frame::difference_of(picture, truth).rmse));
  EXPECT_TRUE(std::isnan(frame::difference_of(picture, truth).max));
}

TEST(WithinUnit, HoldsUpToTheSlackAndNotForNan) {
  EXPECT_TRUE(within_unit(std::vector<float>{0, 1, -0.0005F, 1.0005F}, 1e-3));
  EXPECT_FALSE(within_unit(std::vector<float>{0, 1.01F}, 1e-3));
  EXPECT_FALSE(within_unit(std::vector<float>{-0.01F}, 1e-3));
  EXPECT_FALSE(within_unit(std::vector<float>{std::numeric_limits<float>::quiet_NaN()}, 1e-3));
  EXPECT_FALSE(within_unit(std::vector<float>{std::numeric_limits<float>::infinity()}, 1e-3));
}

TEST(Resample, KeepsAPlaneAndEqualSize) {
  constexpr int w = 6;
  constexpr int h = 4;
  const auto plane = [](int width, int height) {  // in pixels of the picture of w x h
    std::vector<float> rgba;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double px = (x + 0.5) * w / width;
        const double py = (y + 0.5) * h / height;
        for (int c = 0; c < 4; ++c) rgba.push_back(static_cast<float>(0.1 * px + 0.05 * py + c));
      }
    }
    return rgba;
  };
  EXPECT_EQ(resample(plane(w, h), w, h, w, h), plane(w, h));
  const auto larger = resample(plane(w, h), w, h, 2 * w, 2 * h);
  const auto exact = plane(2 * w, 2 * h);
  for (int y = 1; y < 2 * h - 1; ++y) {  // beyond the outer centres it is constant
    for (int x = 1; x < 2 * w - 1; ++x) {
      const std::size_t at = 4 * static_cast<std::size_t>(y * 2 * w + x);
      EXPECT_NEAR(larger[at], exact[at], 1e-6) << x << ' ' << y;
    }
  }
}

TEST(Flip, EqualPicturesGiveZero) {
  const Rgb picture = noisy(filled(120, 80, 200), 40);
  EXPECT_EQ(flip(picture, picture), 0);
}

// |dL*| = 100; the largest possible difference, green to blue after Hunt, is 203.7: 0.95 + 0.05
// (100^.7 - .4 m) / (.6 m) with m = 203.7^.7.
TEST(Flip, BlackAndWhiteGiveNearlyOne) {
  const double m = std::pow(203.7, 0.7);
  const double expected = 0.95 + 0.05 * (std::pow(100, 0.7) - 0.4 * m) / (0.6 * m);
  EXPECT_NEAR(flip(filled(0, 0, 0), filled(255, 255, 255)), expected, 2e-4);
}

TEST(Flip, GreenAndBlueGiveOne) {
  EXPECT_NEAR(flip(filled(0, 255, 0), filled(0, 0, 255)), 1, 1e-9);
}

TEST(Flip, IsSymmetric) {
  const Rgb a = noisy(filled(120, 80, 200), 10);
  const Rgb b = noisy(filled(90, 100, 150), 25);
  EXPECT_NEAR(flip(a, b), flip(b, a), 1e-12);
}

TEST(Flip, OneCodeIsSmallAndGrowsWithNoise) {
  const Rgb clean = filled(128, 128, 128);
  const double one_code = flip(clean, filled(129, 129, 129));
  EXPECT_GT(one_code, 0);
  EXPECT_LT(one_code, 0.04);
  double before = 0;
  for (const double sigma : {2.0, 5.0, 12.0, 30.0, 60.0}) {
    const double now = flip(clean, noisy(clean, sigma));
    EXPECT_GT(now, before) << sigma;
    EXPECT_LE(now, 1);
    before = now;
  }
}

// The eye blurs fine patterns: a checkerboard of single pixels is closer to its mean colour than
// one of coarse squares.
TEST(Flip, IgnoresInvisiblyFineDetail) {
  const auto checker = [](int cell) {
    Rgb rgb;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const std::uint8_t v = (x / cell + y / cell) % 2 == 0 ? 0 : 255;
        rgb.insert(rgb.end(), {v, v, v});
      }
    }
    return rgb;
  };
  const Rgb mean = filled(188, 188, 188);  // half the light of white
  EXPECT_LT(flip(mean, checker(1)), 0.5 * flip(mean, checker(12)));
}

// As many pixels of stripes differ from a uniform background as of one brighter half, and blurring
// (about a pixel) changes little at 8 pixels per stripe; but stripes have more edges.
TEST(Flip, WeightsDifferencesAtEdges) {
  const auto stripes = [](int wide) {
    Rgb rgb;
    for (int i = 0; i < side * side; ++i) {
      const std::uint8_t v = i % side / wide % 2 == 0 ? 60 : 120;
      rgb.insert(rgb.end(), {v, v, v});
    }
    return rgb;
  };
  const Rgb flat = filled(60, 60, 60);
  EXPECT_GT(flip(flat, stripes(8)), 1.2 * flip(flat, stripes(24)));
}

}  // namespace
}  // namespace windsplat::study
