// JPEGs from strips: compared with a JPEG of the same planes in one piece, and parsed by ITU-T
// T.81.
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/image/jpeg_encoder.hpp"
#include "server/image/jpeg_parts.hpp"

namespace windsplat::image {
namespace {

struct Destroy {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Handle = std::unique_ptr<void, Destroy>;

// Waves and noise: no two MCUs are equal.
YccPicture waves(int width, int height, Subsampling subsampling) {
  YccPicture picture;
  picture.reset(width, height, subsampling, {0.1F, 0.2F, 0.3F});
  std::vector<float> rgba;
  rgba.reserve(std::size_t{4} * width * height);
  std::uint32_t state = 1;
  for (int i = 0; i < width * height; ++i) {
    state = state * 1664525U + 1013904223U;
    const float noise = static_cast<float>(state >> 8) * 0x1p-24F;
    const auto x = static_cast<float>(i % width);
    const auto y = static_cast<float>(i / width);
    rgba.insert(rgba.end(), {0.4F + 0.3F * std::sin(0.013F * x), 0.3F * noise,
                             0.4F + 0.3F * std::sin(0.031F * y), 0.9F});
  }
  picture.put({0, 0, width, height, rgba.data(), std::size_t{4} * width});
  return picture;
}

Bytes in_one_piece(const YccPicture& picture, int quality) {
  const Handle compressor(tjInitCompress());
  const bool full = picture.subsampling() == Subsampling::s444;
  std::array<const unsigned char*, 3> planes{};
  std::array<int, 3> strides{};
  for (std::size_t p = 0; p < 3; ++p) {
    planes[p] = picture.planes()[p].samples;
    strides[p] = picture.planes()[p].width;
  }
  unsigned char* jpeg = nullptr;
  unsigned long size = 0;
  EXPECT_EQ(
      tjCompressFromYUVPlanes(compressor.get(), planes.data(), picture.width(), strides.data(),
                              picture.height(), full ? TJSAMP_444 : TJSAMP_420, &jpeg, &size,
                              quality, full ? TJFLAG_ACCURATEDCT : TJFLAG_FASTDCT),
      0);
  Bytes bytes(jpeg, jpeg + size);
  tjFree(jpeg);
  return bytes;
}

// Any warning fails.
Bytes decode(const Bytes& jpeg, int width, int height, int subsampling) {
  const Handle decoder(tjInitDecompress());
  std::array<int, 4> told{};
  EXPECT_EQ(tjDecompressHeader3(decoder.get(), jpeg.data(), jpeg.size(), &told[0], &told[1],
                                &told[2], &told[3]),
            0);
  EXPECT_EQ(told, (std::array<int, 4>{width, height, subsampling, TJCS_YCbCr}));
  Bytes rgb(std::size_t{3} * width * height);
  EXPECT_EQ(tjDecompress2(decoder.get(), jpeg.data(), jpeg.size(), rgb.data(), width, 0, height,
                          TJPF_RGB, TJFLAG_ACCURATEDCT | TJFLAG_STOPONWARNING),
            0)
      << tjGetErrorStr2(decoder.get());
  return rgb;
}

// Restart data of a JPEG: the DRI interval (0 without), and the restart markers in order.
struct Restarts {
  int interval = 0;
  std::vector<int> markers;
};

Restarts restarts_of(const Bytes& jpeg) {
  Restarts found;
  bool scan = false;
  for (std::size_t at = 2; at + 1 < jpeg.size();) {
    if (jpeg[at] != 0xFF || jpeg[at + 1] == 0) {
      EXPECT_TRUE(scan);
      ++at;
      continue;
    }
    const int code = jpeg[at + 1];
    if (code >= 0xD0 && code <= 0xD7) {
      found.markers.push_back(code - 0xD0);
      at += 2;
      continue;
    }
    if (code == 0xD9) return found;
    if (code == 0xDD) found.interval = jpeg[at + 4] * 256 + jpeg[at + 5];
    scan = scan || code == 0xDA;
    at += 2 + std::size_t{jpeg[at + 2]} * 256 + jpeg[at + 3];
  }
  ADD_FAILURE() << "the file has no end marker";
  return found;
}

const std::vector<std::pair<int, int>> many_sizes{
    {1, 1},     {1, 67},     {67, 1},    {17, 9},     {18, 22},     {334, 398}, {640, 480},
    {641, 479}, {1280, 720}, {9, 20000}, {20000, 17}, {1921, 1081}, {47, 3001}};

TEST(JpegStrips, DecodeLikeOnePiece) {
  ThreadPool pool(2);
  JpegEncoder encoder;
  Bytes bytes;
  for (const auto& [width, height] : many_sizes) {
    for (const Subsampling subsampling : {Subsampling::s420, Subsampling::s444}) {
      const YccPicture picture = waves(width, height, subsampling);
      const int quality = subsampling == Subsampling::s444 ? 90 : 80;
      const auto done = encoder.encode(picture, quality, pool, bytes);
      ASSERT_TRUE(done) << done.error().message;
      const int name = subsampling == Subsampling::s444 ? TJSAMP_444 : TJSAMP_420;
      ASSERT_EQ(decode(bytes, width, height, name),
                decode(in_one_piece(picture, quality), width, height, name))
          << width << " x " << height;
    }
  }
}

// Every interval except the last is complete, markers are numbered modulo 8, and large pictures
// have enough strips for many threads.
TEST(JpegStrips, RestartMarkersMarkTheEndsOfStrips) {
  ThreadPool pool(1);
  JpegEncoder encoder;
  Bytes bytes;
  std::size_t most = 0;
  for (const auto& [width, height] : many_sizes) {
    for (const Subsampling subsampling : {Subsampling::s420, Subsampling::s444}) {
      const YccPicture picture = waves(width, height, subsampling);
      ASSERT_TRUE(encoder.encode(picture, 85, pool, bytes));
      const int side = subsampling == Subsampling::s420 ? 16 : 8;
      const int columns = (width + side - 1) / side;
      const int mcus = columns * ((height + side - 1) / side);
      const Restarts found = restarts_of(bytes);
      const auto strips = static_cast<int>(found.markers.size()) + 1;
      most = std::max(most, found.markers.size());
      if (strips == 1) {
        EXPECT_EQ(found.interval, 0);
        continue;
      }
      EXPECT_EQ(found.interval % columns, 0);
      EXPECT_EQ((mcus + found.interval - 1) / found.interval, strips);
      for (int m = 0; m < strips - 1; ++m) EXPECT_EQ(found.markers[m], m % 8);
    }
  }
  EXPECT_GT(most, 8U) << "no picture here wraps around to marker 0";
}

TEST(JpegStrips, AnyThreadCountGivesTheSameBytes) {
  ThreadPool one(1);
  ThreadPool two(2);
  ThreadPool five(5);
  JpegEncoder used;
  for (const auto& [width, height] : many_sizes) {
    const YccPicture picture = waves(width, height, Subsampling::s420);
    Bytes alone;
    Bytes shared;
    Bytes many;
    JpegEncoder fresh;
    ASSERT_TRUE(fresh.encode(picture, 80, one, alone));
    ASSERT_TRUE(used.encode(picture, 80, two, shared));
    ASSERT_TRUE(used.encode(picture, 80, five, many));
    EXPECT_EQ(alone, shared) << width << " x " << height;
    EXPECT_EQ(alone, many) << width << " x " << height;
  }
}

// The frame loop reuses its memory: neither the output nor the planes are reallocated.
TEST(JpegStrips, StorageIsReused) {
  ThreadPool pool(2);
  JpegEncoder encoder;
  YccPicture picture = waves(640, 480, Subsampling::s420);
  Bytes bytes;
  ASSERT_TRUE(encoder.encode(picture, 80, pool, bytes));
  const auto* storage = bytes.data();
  const auto* luma = picture.planes()[0].samples;
  const std::size_t size = bytes.size();
  picture.reset(640, 480, Subsampling::s420, {0.5F, 0.5F, 0.5F});
  ASSERT_TRUE(encoder.encode(picture, 80, pool, bytes));
  EXPECT_LT(bytes.size(), size / 4) << "a uniform picture is small";
  EXPECT_EQ(bytes.data(), storage);
  EXPECT_EQ(picture.planes()[0].samples, luma);
}

TEST(JpegStrips, RefuseSizesTheFormatCannotHold) {
  ThreadPool pool(1);
  JpegEncoder encoder;
  Bytes bytes;
  YccPicture picture;
  picture.reset(8, 8, Subsampling::s420, {});
  EXPECT_EQ(encoder.encode(picture, 0, pool, bytes).error().kind, ErrorKind::invalid);
  EXPECT_EQ(encoder.encode(picture, 101, pool, bytes).error().kind, ErrorKind::invalid);
  picture.reset(65501, 1, Subsampling::s420, {});
  EXPECT_EQ(encoder.encode(picture, 80, pool, bytes).error().kind, ErrorKind::too_large);
}

// Its MCUs extend beyond the limit of the library.
TEST(JpegStrips, SupportTheLongestEdgeOfTheFormat) {
  ThreadPool pool(1);
  JpegEncoder encoder;
  Bytes bytes;
  const std::vector<std::pair<int, int>> longest{{65500, 3}, {65497, 17}, {3, 65500}};
  for (const auto& [width, height] : longest) {
    for (const Subsampling subsampling : {Subsampling::s420, Subsampling::s444}) {
      const YccPicture picture = waves(width, height, subsampling);
      const auto done = encoder.encode(picture, 80, pool, bytes);
      ASSERT_TRUE(done) << done.error().message;
      const int name = subsampling == Subsampling::s444 ? TJSAMP_444 : TJSAMP_420;
      EXPECT_EQ(decode(bytes, width, height, name),
                decode(in_one_piece(picture, 80), width, height, name))
          << width << " x " << height;
    }
  }
}

// A decoder reads all strips with the tables of the first one.
TEST(JpegStitch, RefusesStripsWithOtherTables) {
  ThreadPool pool(1);
  JpegEncoder encoder;
  Bytes first;
  Bytes other;
  const YccPicture picture = waves(64, 16, Subsampling::s420);
  ASSERT_TRUE(encoder.encode(picture, 80, pool, first));
  ASSERT_TRUE(encoder.encode(picture, 70, pool, other));
  Bytes out;
  const auto done =
      stitch(std::vector<std::span<const std::uint8_t>>{first, other}, {64, 32, 4}, out);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::internal);
  // A last strip of another height is valid.
  ASSERT_TRUE(encoder.encode(waves(64, 9, Subsampling::s420), 80, pool, other));
  EXPECT_TRUE(stitch(std::vector<std::span<const std::uint8_t>>{first, other}, {64, 25, 4}, out));
}

TEST(JpegStitch, RefusesStripsOfAnotherShape) {
  ThreadPool pool(1);
  JpegEncoder encoder;
  Bytes strip;
  ASSERT_TRUE(encoder.encode(waves(64, 16, Subsampling::s420), 80, pool, strip));
  const auto kind_of = [](const Bytes& bytes) {
    const std::vector<std::span<const std::uint8_t>> strips{bytes, bytes};
    Bytes out;
    const auto done = stitch(strips, {64, 32, 4}, out);
    return done ? "none" : done.error().kind == ErrorKind::internal ? "internal" : "another";
  };
  EXPECT_STREQ(kind_of(strip), "none");
  EXPECT_STREQ(kind_of({}), "internal");
  for (std::size_t size = 0; size + 1 < strip.size(); ++size) {
    Bytes cut(strip.begin(), strip.begin() + static_cast<std::ptrdiff_t>(size));
    ASSERT_STREQ(kind_of(cut), "internal") << size;
    if (size >= 2 && size < 600) {  // with an end marker, but with a truncated header
      cut[size - 2] = 0xFF;
      cut[size - 1] = 0xD9;
      ASSERT_STREQ(kind_of(cut), "internal") << size;
    }
  }
  Bytes progressive = strip;
  for (std::size_t i = 0; i + 1 < progressive.size(); ++i) {
    if (progressive[i] == 0xFF && progressive[i + 1] == 0xC0) progressive[i + 1] = 0xC2;
  }
  EXPECT_STREQ(kind_of(progressive), "internal");
  Bytes with_restarts;
  ASSERT_TRUE(encoder.encode(waves(640, 480, Subsampling::s420), 80, pool, with_restarts));
  EXPECT_STREQ(kind_of(with_restarts), "internal");
}

}  // namespace
}  // namespace windsplat::image
