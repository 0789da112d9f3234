// Pictures encoded, then decoded again by the libraries' decoders; NPY parsed byte by byte.
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "decoded_png.hpp"
#include "server/image/encode.hpp"

namespace windsplat::image {
namespace {

struct Picture {
  int width = 0;
  int height = 0;
  int subsampling = -1;  // JPEG only
  std::vector<std::uint8_t> rgb;
};

// Smooth, with different channels: the typical content of JPEG.
Picture smooth_picture(int width, int height) {
  Picture picture{width, height, -1, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      picture.rgb.push_back(static_cast<std::uint8_t>(128 + 100 * std::sin(0.02 * x)));
      picture.rgb.push_back(static_cast<std::uint8_t>(128 + 100 * std::cos(0.03 * y)));
      picture.rgb.push_back(static_cast<std::uint8_t>(128 + 90 * std::sin(0.01 * (x + y))));
    }
  }
  return picture;
}

// No two neighbours are equal: any misplaced pixel is detected.
Picture busy_picture(int width, int height) {
  Picture picture{width, height, -1, {}};
  std::uint32_t state = 12345;
  for (int i = 0; i < 3 * width * height; ++i) {
    state = state * 1664525U + 1013904223U;
    picture.rgb.push_back(static_cast<std::uint8_t>(state >> 24));
  }
  return picture;
}

Picture decoded_jpeg(const Bytes& bytes) {
  Picture picture;
  tjhandle decoder = tjInitDecompress();
  int colorspace = 0;
  EXPECT_EQ(tjDecompressHeader3(decoder, bytes.data(), bytes.size(), &picture.width,
                                &picture.height, &picture.subsampling, &colorspace),
            0);
  picture.rgb.resize(3 * static_cast<std::size_t>(picture.width * picture.height));
  EXPECT_EQ(tjDecompress2(decoder, bytes.data(), bytes.size(), picture.rgb.data(), 0, 0, 0,
                          TJPF_RGB, TJFLAG_ACCURATEDCT),
            0);
  tjDestroy(decoder);
  return picture;
}

double root_mean_square(const Picture& a, const Picture& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    const double difference = static_cast<double>(a.rgb[i]) - b.rgb[i];
    sum += difference * difference;
  }
  return std::sqrt(sum / static_cast<double>(a.rgb.size()));
}

const std::vector<std::pair<int, int>> few_sizes{{1, 1}, {1, 67}, {67, 1}, {17, 9}, {256, 64}};

TEST(Jpeg, KeepsSizeSubsamplingAndColors) {
  for (const auto& [width, height] : few_sizes) {
    for (const Subsampling subsampling : {Subsampling::s444, Subsampling::s420}) {
      const Picture picture = smooth_picture(width, height);
      const auto bytes = encode_jpeg(picture.rgb, width, height, 95, subsampling);
      ASSERT_TRUE(bytes) << bytes.error().message;
      const Picture back = decoded_jpeg(*bytes);
      EXPECT_EQ(back.width, width);
      EXPECT_EQ(back.height, height);
      EXPECT_EQ(back.subsampling, subsampling == Subsampling::s444 ? TJSAMP_444 : TJSAMP_420);
      EXPECT_LT(root_mean_square(picture, back), 3) << width << " x " << height;
    }
  }
}

TEST(Jpeg, HigherQualityIsNearerAndLarger) {
  const Picture picture = busy_picture(64, 64);
  const auto coarse = encode_jpeg(picture.rgb, 64, 64, 20, Subsampling::s444);
  const auto fine = encode_jpeg(picture.rgb, 64, 64, 95, Subsampling::s444);
  ASSERT_TRUE(coarse && fine);
  EXPECT_LT(root_mean_square(picture, decoded_jpeg(*fine)),
            root_mean_square(picture, decoded_jpeg(*coarse)));
  EXPECT_GT(fine->size(), coarse->size());
}

TEST(Jpeg, RefusesSizesTheFormatCannotHold) {
  const std::vector<std::uint8_t> pixel{1, 2, 3};
  EXPECT_EQ(encode_jpeg(pixel, 1, 1, 0, Subsampling::s444).error().kind, ErrorKind::invalid);
  EXPECT_EQ(encode_jpeg(pixel, 1, 1, 101, Subsampling::s444).error().kind, ErrorKind::invalid);
  EXPECT_EQ(encode_jpeg({}, 0, 1, 90, Subsampling::s444).error().kind, ErrorKind::too_large);
  EXPECT_EQ(encode_jpeg({}, 70000, 1, 90, Subsampling::s420).error().kind, ErrorKind::too_large);
}

TEST(Png, IsLossless) {
  for (const auto& [width, height] : few_sizes) {
    for (const Picture& picture : {smooth_picture(width, height), busy_picture(width, height)}) {
      const auto bytes = encode_png(picture.rgb, width, height);
      ASSERT_TRUE(bytes) << bytes.error().message;
      const test::DecodedPng back = test::decoded_png(*bytes);
      EXPECT_EQ(back.width, width);
      EXPECT_EQ(back.height, height);
      EXPECT_EQ(back.rgb, picture.rgb);
    }
  }
}

struct Chunk {
  std::string name;
  Bytes data;
};

std::vector<Chunk> chunks_of(const Bytes& png) {
  std::vector<Chunk> chunks;
  for (std::size_t at = 8; at + 12 <= png.size();) {
    const std::uint8_t* chunk = png.data() + at;
    const std::size_t size =
        std::size_t{chunk[0]} << 24 | std::size_t{chunk[1]} << 16 | chunk[2] << 8 | chunk[3];
    chunks.push_back({std::string(chunk + 4, chunk + 8), Bytes(chunk + 8, chunk + 8 + size)});
    at += size + 12;
  }
  return chunks;
}

// The picture declares sRGB with relative colorimetric intent.
TEST(Png, HasTheExpectedChunks) {
  const auto bytes = encode_png(busy_picture(200, 200).rgb, 200, 200);
  ASSERT_TRUE(bytes) << bytes.error().message;
  std::vector<std::string> names;
  for (const Chunk& chunk : chunks_of(*bytes)) {
    if (chunk.name == "sRGB") {
      EXPECT_EQ(chunk.data, Bytes{1});
    }
    if (names.empty() || names.back() != chunk.name) names.push_back(chunk.name);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"IHDR", "sRGB", "IDAT", "IEND"}));
}

// PNG, 11.3.5.3: pixels to the metre of both axes, and 1 for metres. 300 / 0.0254 = 11811.02.
TEST(Png, TellsItsSizeInPrint) {
  const auto bytes = encode_png(busy_picture(20, 10).rgb, 20, 10, {}, 300);
  ASSERT_TRUE(bytes) << bytes.error().message;
  const auto chunks = chunks_of(*bytes);
  ASSERT_GE(chunks.size(), 3U);
  EXPECT_EQ(chunks[2].name, "pHYs");
  EXPECT_EQ(chunks[2].data, (Bytes{0, 0, 0x2e, 0x23, 0, 0, 0x2e, 0x23, 1}));
  EXPECT_EQ(test::decoded_png(*bytes).rgb, busy_picture(20, 10).rgb);
}

TEST(Png, CompressesAUniformPicture) {
  const std::vector<std::uint8_t> rgb(std::size_t{3} * 256 * 256, 40);
  const auto bytes = encode_png(rgb, 256, 256);
  ASSERT_TRUE(bytes);
  EXPECT_LT(bytes->size(), rgb.size() / 50);
}

TEST(Png, RefusesAnEmptyPicture) {
  EXPECT_EQ(encode_png({}, 0, 4).error().kind, ErrorKind::invalid);
}

TEST(Png, LibraryFailureIsAnError) {
  constexpr int over_its_limit = 1000001;
  const std::vector<std::uint8_t> row(std::size_t{3} * over_its_limit);
  const auto refused = encode_png(row, over_its_limit, 1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::internal);
  EXPECT_EQ(refused.error().message, "PNG: Invalid IHDR data");
}

TEST(Png, StopsWhenCancelled) {
  const Picture picture = busy_picture(64, 64);
  const CancelToken cancel;
  cancel.cancel();
  const auto stopped = encode_png(picture.rgb, 64, 64, cancel);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::cancelled);
}

// NPY 1.0: "\x93NUMPY", 1, 0, u16 header length, a Python dict ending with a line feed, values
// starting at a multiple of 64.
TEST(Npy, HeaderAndValuesFollowTheFormat) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 67}, {67, 1}, {1280, 720}}) {
    std::vector<float> rgba(4 * static_cast<std::size_t>(width * height));
    for (std::size_t i = 0; i < rgba.size(); ++i) rgba[i] = 0.25F * static_cast<float>(i) - 3.0F;
    const auto bytes = encode_npy(rgba, width, height);
    ASSERT_TRUE(bytes) << bytes.error().message;

    ASSERT_GT(bytes->size(), 10U);
    EXPECT_EQ(std::string(bytes->begin() + 1, bytes->begin() + 6), "NUMPY");
    EXPECT_EQ((*bytes)[0], 0x93);
    EXPECT_EQ((*bytes)[6], 1);
    EXPECT_EQ((*bytes)[7], 0);
    const std::size_t header_bytes = (*bytes)[8] + 256U * (*bytes)[9];
    const std::size_t values_at = 10 + header_bytes;
    EXPECT_EQ(values_at % 64, 0U);
    ASSERT_EQ(bytes->size(), values_at + 4 * rgba.size());

    const std::string header(bytes->begin() + 10, bytes->begin() + static_cast<long>(values_at));
    EXPECT_EQ(header.back(), '\n');
    EXPECT_NE(header.find("'descr': '<f4'"), std::string::npos);
    EXPECT_NE(header.find("'fortran_order': False"), std::string::npos);
    EXPECT_NE(
        header.find("'shape': (" + std::to_string(height) + ", " + std::to_string(width) + ", 4)"),
        std::string::npos);
    for (const std::size_t i : {std::size_t{0}, rgba.size() / 2, rgba.size() - 1}) {
      const std::uint8_t* at = bytes->data() + values_at + 4 * i;
      const std::uint32_t bits =
          at[0] | at[1] << 8 | at[2] << 16 | static_cast<std::uint32_t>(at[3]) << 24;
      float value = 0;
      std::memcpy(&value, &bits, sizeof value);
      EXPECT_EQ(value, rgba[i]);
    }
  }
}

}  // namespace
}  // namespace windsplat::image
