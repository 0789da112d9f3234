// Planes of YCbCr compared with the formulas of IEC 61966-2-1 and ITU-T T.871, pixel by pixel.
#include "server/image/ycc.hpp"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/image/decode.hpp"
#include "server/image/jpeg_encoder.hpp"

namespace windsplat::image {
namespace {

using Colour = std::array<float, 3>;

struct Pixels {
  int width = 0;
  int height = 0;
  std::vector<float> rgba;
};

// Every pixel different, including opaque and transparent ones.
Pixels busy(int width, int height, unsigned seed) {
  Pixels pixels{width, height, std::vector<float>(std::size_t{4} * width * height)};
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  for (std::size_t i = 0; i < pixels.rgba.size(); i += 4) {
    const float alpha = std::clamp(1.5F * unit(random) - 0.25F, 0.0F, 1.0F);
    // Dark values as often as light ones: codes are narrowest there.
    for (int c = 0; c < 3; ++c) pixels.rgba[i + c] = alpha * std::pow(unit(random), 4.0F);
    pixels.rgba[i + 3] = alpha;
  }
  return pixels;
}

// As delivered by the engine: tiles of 64 x 64 from separate buffers.
void put_tiles(const Pixels& pixels, YccPicture& picture) {
  constexpr int side = 64;
  std::vector<float> tile(std::size_t{4} * side * side);
  for (int y = (pixels.height - 1) / side * side; y >= 0; y -= side) {
    for (int x = 0; x < pixels.width; x += side) {
      Part part{x,
                y,
                std::min(side, pixels.width - x),
                std::min(side, pixels.height - y),
                tile.data(),
                std::size_t{4} * side};
      std::fill(tile.begin(), tile.end(), 0.5F);
      for (int row = 0; row < part.height; ++row) {
        std::copy_n(pixels.rgba.data() + 4 * ((std::size_t{1} * y + row) * pixels.width + x),
                    4 * part.width, tile.data() + row * part.stride);
      }
      picture.put(part);
    }
  }
}

std::array<double, 3> formula(const float* rgba, const Colour& background) {
  std::array<double, 3> rgb{};
  for (int c = 0; c < 3; ++c) {
    double x = double{rgba[c]} + (1 - double{rgba[3]}) * double{background[c]};
    x = x > 0 ? std::min(x, 1.0) : 0;
    rgb[c] = 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055);
  }
  const double luma = 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2];
  return {luma, 128 + (rgb[2] - luma) / 1.772, 128 + (rgb[0] - luma) / 1.402};
}

// The value of a plane sample, including padding.
double expected(const Pixels& pixels, const Colour& background, Subsampling subsampling, int plane,
                int x, int y) {
  const int side = plane > 0 && subsampling == Subsampling::s420 ? 2 : 1;
  x = std::min(x, (pixels.width - 1) / side);
  y = std::min(y, (pixels.height - 1) / side);
  double sum = 0;
  for (int i = 0; i < side * side; ++i) {
    const int px = std::min(side * x + i % side, pixels.width - 1);
    const int py = std::min(side * y + i / side, pixels.height - 1);
    const std::size_t at = 4 * (static_cast<std::size_t>(py) * pixels.width + px);
    sum += formula(&pixels.rgba[at], background)[plane];
  }
  return sum / (side * side);
}

double worst_sample(const Pixels& pixels, const Colour& background, const YccPicture& picture) {
  double worst = 0;
  for (int p = 0; p < 3; ++p) {
    const auto& plane = picture.planes()[p];
    for (int y = 0; y < plane.height; ++y) {
      for (int x = 0; x < plane.width; ++x) {
        const double value = expected(pixels, background, picture.subsampling(), p, x, y);
        const double found = plane.samples[static_cast<std::ptrdiff_t>(y) * plane.width + x];
        worst = std::max(worst, std::abs(found - value));
      }
    }
  }
  return worst;
}

// Half a code is the error of exact rounding; the polynomial adds 1/12 per channel.
constexpr double tolerance = 0.5 + 0.15;

TEST(Ycc, MatchesTheFormulaAtEverySizeAndBeyondTheEdges) {
  const Colour background{0.02F, 0.3F, 0.9F};
  YccPicture picture;
  for (const Subsampling subsampling : {Subsampling::s420, Subsampling::s444}) {
    for (int width = 1; width <= 67; ++width) {
      const int height = 68 - width;
      const Pixels pixels = busy(width, height, static_cast<unsigned>(width));
      picture.reset(width, height, subsampling, background);
      put_tiles(pixels, picture);
      ASSERT_LE(worst_sample(pixels, background, picture), tolerance) << width << " x " << height;
    }
    const Pixels pixels = busy(131, 133, 1);
    picture.reset(131, 133, subsampling, background);
    put_tiles(pixels, picture);
    EXPECT_LE(worst_sample(pixels, background, picture), tolerance);
    // In one part, wider than a block.
    picture.reset(131, 133, subsampling, background);
    picture.put({0, 0, 131, 133, pixels.rgba.data(), std::size_t{4} * 131});
    EXPECT_LE(worst_sample(pixels, background, picture), tolerance);
  }
}

// Parts may begin at any multiple of chroma samples: the last one may start within the last MCU or
// long before.
TEST(Ycc, PartsMayBeSplitWithinAnMcu) {
  const Colour background{0.02F, 0.3F, 0.9F};
  YccPicture picture;
  for (const int width : {66, 67, 81, 130}) {
    const Pixels pixels = busy(width, 18, static_cast<unsigned>(width));
    for (int cut = 2; cut < width; cut += 2) {
      for (const Subsampling subsampling : {Subsampling::s420, Subsampling::s444}) {
        picture.reset(width, 18, subsampling, background);
        const std::size_t stride = std::size_t{4} * width;
        picture.put({0, 0, cut, 18, pixels.rgba.data(), stride});
        picture.put({cut, 0, width - cut, 18, pixels.rgba.data() + std::size_t{4} * cut, stride});
        ASSERT_LE(worst_sample(pixels, background, picture), tolerance) << width << " at " << cut;
      }
    }
  }
}

TEST(Ycc, PlanesExtendToWholeMcus) {
  YccPicture picture;
  picture.reset(17, 33, Subsampling::s420, {});
  EXPECT_EQ(picture.planes()[0].width, 32);
  EXPECT_EQ(picture.planes()[0].height, 48);
  EXPECT_EQ(picture.planes()[2].width, 16);
  EXPECT_EQ(picture.planes()[2].height, 24);
  picture.reset(17, 33, Subsampling::s444, {});
  EXPECT_EQ(picture.planes()[0].width, 24);
  EXPECT_EQ(picture.planes()[1].height, 40);
}

// No seam between delivered and omitted blank tiles.
TEST(Ycc, MissingTilesAreTransparentPixels) {
  for (const Subsampling subsampling : {Subsampling::s420, Subsampling::s444}) {
    for (int shade = 0; shade <= 100; ++shade) {
      const Colour background{0.01F * shade, 1.0F - 0.01F * shade, 1e-4F * shade * shade};
      YccPicture untouched;
      YccPicture clear;
      untouched.reset(21, 19, subsampling, background);
      clear.reset(21, 19, subsampling, background);
      const std::vector<float> nothing(std::size_t{4} * 21 * 19);
      clear.put({0, 0, 21, 19, nothing.data(), std::size_t{4} * 21});
      for (int p = 0; p < 3; ++p) {
        const auto& a = untouched.planes()[p];
        const auto& b = clear.planes()[p];
        ASSERT_TRUE(
            std::equal(a.samples, a.samples + std::ptrdiff_t{1} * a.width * a.height, b.samples))
            << shade;
      }
      ASSERT_LE(worst_sample({21, 19, nothing}, background, untouched), tolerance);
    }
  }
}

TEST(Ycc, GraysHaveNoChromaAndPrimariesTheExtremes) {
  YccPicture picture;
  const auto codes = [&](Colour colour) {
    picture.reset(1, 1, Subsampling::s444, colour);
    const auto& planes = picture.planes();
    return std::array<int, 3>{planes[0].samples[0], planes[1].samples[0], planes[2].samples[0]};
  };
  using Codes = std::array<int, 3>;
  EXPECT_EQ(codes({0, 0, 0}), (Codes{0, 128, 128}));
  EXPECT_EQ(codes({1, 1, 1}), (Codes{255, 128, 128}));
  EXPECT_EQ(codes({0.2158605F, 0.2158605F, 0.2158605F}), (Codes{128, 128, 128}));
  EXPECT_EQ(codes({1, 0, 0}), (Codes{76, 85, 255}));
  EXPECT_EQ(codes({0, 0, 1}), (Codes{29, 255, 107}));
  constexpr float infinity = std::numeric_limits<float>::infinity();
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(codes({infinity, 7, infinity}), codes({1, 1, 1}));
  EXPECT_EQ(codes({-infinity, -7, nan}), codes({0, 0, 0}));
}

// A row of vectors with zeros in one channel, or in all but one.
TEST(Ycc, OnlyFullyTransparentPixelsAreSkipped) {
  const Colour background{0.9F, 0.5F, 0.2F};
  YccPicture picture;
  for (int channel = 0; channel < 4; ++channel) {
    for (const bool alone : {false, true}) {
      Pixels pixels{64, 2, std::vector<float>(std::size_t{4} * 128, alone ? 0.0F : 0.5F)};
      for (std::size_t i = channel; i < pixels.rgba.size(); i += 4) {
        pixels.rgba[i] = alone ? 0.5F : 0.0F;
      }
      picture.reset(64, 2, Subsampling::s444, background);
      put_tiles(pixels, picture);
      EXPECT_LE(worst_sample(pixels, background, picture), tolerance) << channel;
    }
  }
}

Bytes samples_of(const YccPicture& picture) {
  Bytes samples;
  for (const auto& plane : picture.planes()) {
    samples.insert(samples.end(), plane.samples,
                   plane.samples + std::ptrdiff_t{1} * plane.width * plane.height);
  }
  return samples;
}

// Every instruction set of this processor; those with fused multiply-add (on x86 AVX2 and above,
// which have lower bits) agree exactly.
TEST(Ycc, InstructionSetsAgree) {
  const Pixels pixels = busy(200, 131, 7);
  const Colour background{0.02F, 0.3F, 0.9F};
  std::vector<Bytes> fused;
  const std::int64_t all = hwy::SupportedTargets() & HWY_TARGETS;
  for (std::int64_t left = all; left != 0; left &= left - 1) {
    const std::int64_t target = left & -left;
    hwy::GetChosenTarget().Update(target);
    YccPicture picture;
    picture.reset(200, 131, Subsampling::s420, background);
    put_tiles(pixels, picture);
    EXPECT_LE(worst_sample(pixels, background, picture), tolerance) << hwy::TargetName(target);
    if (HWY_ARCH_X86 && target <= HWY_AVX2) fused.push_back(samples_of(picture));
  }
  hwy::GetChosenTarget().DeInit();
  for (const Bytes& samples : fused) EXPECT_EQ(samples, fused.front());
}

// The names of features are those of the kernel.
TEST(Ycc, InstructionSetsAreThoseOfTheProcessor) {
  std::ifstream file("/proc/cpuinfo");
  std::string line;
  while (std::getline(file, line) && !line.starts_with("flags")) {
  }
  if (!HWY_ARCH_X86 || line.empty()) GTEST_SKIP() << "no flags of an x86 processor are known";
  line += ' ';
  const auto has = [&](const std::vector<std::string>& names) {
    return std::all_of(names.begin(), names.end(), [&](const std::string& name) {
      return line.find(' ' + name + ' ') != std::string::npos;
    });
  };
  const std::int64_t found = hwy::SupportedTargets();
  const bool sse4 = has({"ssse3", "sse4_1", "sse4_2", "popcnt", "pclmulqdq", "aes"});
  // Not "abm" (LZCNT): some virtual machines hide it from the kernel, and every processor with
  // AVX2 has it.
  const bool avx2 = sse4 && has({"avx2", "fma", "bmi1", "bmi2", "f16c"});
  const bool avx512 = avx2 && has({"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"});
  EXPECT_EQ((found & HWY_SSE4) != 0, sse4);
  EXPECT_EQ((found & HWY_AVX2) != 0, avx2);
  EXPECT_EQ((found & HWY_AVX3) != 0, avx512);
  EXPECT_NE(found & HWY_TARGETS, 0);
}

// A second picture with a different size and background contains nothing of the first.
TEST(Ycc, ReusedStorageStartsAsBackground) {
  YccPicture picture;
  picture.reset(64, 64, Subsampling::s420, {1, 1, 1});
  put_tiles(busy(64, 64, 3), picture);
  picture.reset(40, 24, Subsampling::s444, {0, 0, 0});
  EXPECT_LE(worst_sample({40, 24, std::vector<float>(std::size_t{4} * 40 * 24)}, {}, picture), 0.5);
}

TEST(Ycc, PartsThatSplitAChromaSampleAreABug) {
  YccPicture picture;
  picture.reset(8, 8, Subsampling::s420, {});
  const std::vector<float> rgba(std::size_t{4} * 64);
  EXPECT_THROW(picture.put({1, 0, 2, 2, rgba.data(), 32}), std::logic_error);
  EXPECT_THROW(picture.put({0, 0, 3, 2, rgba.data(), 32}), std::logic_error);
  EXPECT_THROW(picture.put({0, 0, 10, 2, rgba.data(), 32}), std::logic_error);
  picture.reset(8, 8, Subsampling::s444, {});
  EXPECT_NO_THROW(picture.put({1, 0, 3, 3, rgba.data(), 32}));
}

// The same picture through rounded RGB codes and the library's colour conversion.
TEST(Ycc, DecodedPictureEqualsTheRgbPath) {
  ThreadPool pool(1);
  JpegEncoder encoder;
  YccPicture picture;
  for (int width = 1; width <= 67; width += 3) {
    const int height = 68 - width;
    // Smooth: at quality 100 an encoder preserves what neighbours share, in both ways.
    Pixels pixels{width, height, {}};
    for (int i = 0; i < width * height; ++i) {
      const float x = 0.05F * static_cast<float>(i % width);
      const float y = 0.04F * static_cast<float>(i / width);
      pixels.rgba.insert(pixels.rgba.end(), {0.3F + 0.3F * std::sin(x), 0.3F + 0.3F * std::cos(y),
                                             0.2F + 0.2F * std::sin(x + y), 0.7F});
    }
    const Colour background{0.1F, 0.2F, 0.6F};
    const Bytes rgb = tone_map(pixels.rgba, width, height, background);
    for (const Subsampling subsampling : {Subsampling::s420, Subsampling::s444}) {
      const auto one_piece = encode_jpeg(rgb, width, height, 100, subsampling);
      picture.reset(width, height, subsampling, background);
      put_tiles(pixels, picture);
      Bytes bytes;
      ASSERT_TRUE(encoder.encode(picture, 100, pool, bytes));
      const auto a = decode_jpeg(*one_piece, width, height);
      const auto b = decode_jpeg(bytes, width, height);
      ASSERT_TRUE(a && b);
      double sum = 0;
      for (std::size_t i = 0; i < a->size(); ++i) {
        // Rounding in different places and in the transforms: at most two codes of luma and chroma;
        // in blue, chroma has the weight 1.77.
        ASSERT_NEAR((*a)[i], (*b)[i], 5) << width;
        sum += std::abs((*a)[i] - (*b)[i]);
      }
      EXPECT_LE(sum / static_cast<double>(a->size()), 1) << width;
    }
  }
}

}  // namespace
}  // namespace windsplat::image
