// Boxes of samples and the chunks that they touch: by counting over every sample.
#include "server/data/model/box.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace windsplat::data {
namespace {

using BoxIndex = std::array<int, 3>;

// The chunk of a sample along an axis, counted from any.
int box_chunk_of(int index, std::size_t axis, const FieldInfo& field) {
  const int length = field.box_chunk.at(axis);
  return (index - field.box_chunk_first.at(axis) + length) / length;
}

std::set<int> box_chunks_of(const Box& box, std::size_t axis, int stride, const FieldInfo& field) {
  std::set<int> out;
  for (int n = 0; n < box.count.at(axis); n += stride) {
    out.insert(box_chunk_of(box.first.at(axis) + n, axis, field));
  }
  return out;
}

struct DrawnBox {
  FieldInfo field;
  BoxIndex dims{};
  Box box;
  int stride = 1;
};

DrawnBox draw_box(std::mt19937& random) {
  const auto to = [&](int most) { return std::uniform_int_distribution<int>(0, most)(random); };
  DrawnBox out;
  out.field.components.resize(static_cast<std::size_t>(1 + to(2)));
  for (std::size_t a = 0; a < 3; ++a) {
    out.dims.at(a) = 1 + to(29);
    out.field.box_chunk.at(a) = 1 + to(std::min(7, out.dims.at(a) - 1));
    out.field.box_chunk_first.at(a) = to(out.field.box_chunk.at(a) - 1);
    out.box.first.at(a) = to(out.dims.at(a) - 1);
    out.box.count.at(a) = 1 + to(out.dims.at(a) - 1 - out.box.first.at(a));
  }
  out.stride = 1 + to(9);
  return out;
}

TEST(Box, LiesWithinAGridFromItsFirstToItsLastSample) {
  const BoxIndex dims{4, 3, 2};
  EXPECT_TRUE(is_within({{0, 0, 0}, {4, 3, 2}}, dims));
  EXPECT_TRUE(is_within({{3, 2, 1}, {1, 1, 1}}, dims));
  constexpr int most = std::numeric_limits<int>::max();
  constexpr int least = std::numeric_limits<int>::min();
  for (std::size_t a = 0; a < 3; ++a) {
    for (const auto& [first, count] : std::vector<std::array<int, 2>>{{0, dims.at(a) + 1},
                                                                      {1, dims.at(a)},
                                                                      {dims.at(a), 1},
                                                                      {-1, 1},
                                                                      {0, 0},
                                                                      {0, -1},
                                                                      {most, 1},
                                                                      {1, most},
                                                                      {most, most},
                                                                      {least, 1},
                                                                      {0, least},
                                                                      {least, least}}) {
      Box box = whole_box(dims);
      box.first.at(a) = first;
      box.count.at(a) = count;
      EXPECT_FALSE(is_within(box, dims)) << a << ' ' << first << ' ' << count;
    }
  }
}

TEST(Box, CutHoldsItsSamplesWithTheirOwnRange) {
  Volume volume;
  volume.dims = {4, 3, 2};
  volume.components = 2;
  volume.values = Samples(48);
  for (std::size_t n = 0; n < 48; ++n) volume.values[n] = static_cast<float>(n);
  volume.values[6] = volume.values[30] = std::numeric_limits<float>::quiet_NaN();
  finish_volume(volume);
  const Volume part = cut(volume, {{1, 1, 0}, {2, 1, 2}});
  EXPECT_EQ(part.dims, (BoxIndex{2, 1, 2}));
  EXPECT_EQ(part.components, 2);
  ASSERT_EQ(part.values.size(), 8U);
  const std::vector<float> wanted{5, 0, 17, 18, 29, 0, 41, 42};
  for (std::size_t n = 0; n < 8; ++n) {
    const bool is_masked = n % 4 == 1;
    EXPECT_EQ(std::isnan(part.values[n]), is_masked) << n;
    if (is_masked) continue;
    EXPECT_EQ(part.values[n], wanted[n]) << n;
  }
  EXPECT_EQ(part.masked, 1);
  EXPECT_FLOAT_EQ(part.range[0], std::hypot(5.0F, 29.0F));
  EXPECT_FLOAT_EQ(part.range[1], std::hypot(18.0F, 42.0F));
}

TEST(Box, AroundASampleIsWithinItsChunk) {
  std::mt19937 random(1);
  for (int round = 0; round < 2000; ++round) {
    const DrawnBox one = draw_box(random);
    const BoxIndex& index = one.box.first;
    const Box box = box_around(index, one.field, one.dims);
    ASSERT_TRUE(is_within(box, one.dims));
    for (std::size_t a = 0; a < 3; ++a) {
      EXPECT_EQ(box_chunks_of(box, a, 1, one.field),
                std::set<int>{box_chunk_of(index.at(a), a, one.field)});
      EXPECT_LE(box.first.at(a), index.at(a));
      EXPECT_LT(index.at(a), box.first.at(a) + box.count.at(a));
      // All of the chunk, as it is short.
      for (const int beside : {box.first.at(a) - 1, box.first.at(a) + box.count.at(a)}) {
        if (beside < 0 || beside == one.dims.at(a)) continue;
        EXPECT_NE(box_chunk_of(beside, a, one.field), box_chunk_of(index.at(a), a, one.field));
      }
    }
  }
}

TEST(Box, AroundASampleOfALongChunkHasSixtyFourSamples) {
  FieldInfo field;
  field.components = {"f"};
  field.box_chunk = {1000, 1000, 1};
  field.box_chunk_first = {0, 500, 0};
  const Box box = box_around({130, 510, 3}, field, {1000, 1000, 10});
  EXPECT_EQ(box, (Box{{128, 500, 3}, {64, 64, 1}}));
  EXPECT_EQ(box_around({999, 499, 3}, field, {1000, 1000, 10}), (Box{{960, 448, 3}, {40, 52, 1}}));
}

TEST(Box, ShareIsThatOfTheSamplesInItsChunks) {
  std::mt19937 random(2);
  for (int round = 0; round < 500; ++round) {
    DrawnBox one = draw_box(random);
    for (std::size_t a = 0; a < 3; ++a) {  // no cut chunks
      one.field.box_chunk_first.at(a) = 0;
      one.dims.at(a) += (one.field.box_chunk.at(a) - one.dims.at(a) % one.field.box_chunk.at(a)) %
                        one.field.box_chunk.at(a);
    }
    // Layers between strided chunks are left out, those between strided samples are not.
    const int stride = one.stride > one.field.box_chunk[2] ? one.stride : 1;
    double wanted = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto chunks = box_chunks_of(one.box, a, a == 2 ? stride : 1, one.field).size();
      wanted *= static_cast<double>(chunks) * one.field.box_chunk.at(a) / one.dims.at(a);
    }
    EXPECT_NEAR(decoded_share(one.box, one.stride, one.field, one.dims), wanted, 1e-12);
  }
}

TEST(Box, ChunksAreThoseOfItsSamples) {
  std::mt19937 random(12);
  for (int round = 0; round < 500; ++round) {
    const DrawnBox drawn = draw_box(random);
    std::size_t chunks = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      chunks *= box_chunks_of(drawn.box, a, 1, drawn.field).size();
    }
    ASSERT_EQ(chunks_of(drawn.box, drawn.field), chunks) << key_of(drawn.box);
  }
}

TEST(Box, LayersAreLeftOutWhereThatSavesMoreThanARead) {
  FieldInfo wind;
  wind.components = {"u", "v"};
  wind.box_chunk = {16, 1, 2};
  const std::array<int, 3> dims{512, 512, 99};
  // 256 x 256 x 2 values a layer.
  const Box box{{17, 0, 0}, {240, 256, 99}};
  EXPECT_EQ(layers_apart(box, 3, wind, dims, 131072), 3) << "one layer";
  EXPECT_EQ(layers_apart(box, 3, wind, dims, 131073), 1);
  EXPECT_EQ(layers_apart(box, 4, wind, dims, 262144), 4);
  EXPECT_EQ(layers_apart(box, 2, wind, dims, 1), 1) << "a chunk holds the next";
  EXPECT_EQ(layers_apart({{0, 0, 0}, {1, 1, 99}}, 64, wind, dims), 1);
  EXPECT_EQ(layers_apart(whole_box(dims), 3, wind, dims), 3);
}

TEST(Box, PiecesHoldEveryTakenLayerOnceInWholeChunks) {
  std::mt19937 random(3);
  for (int round = 0; round < 1000; ++round) {
    const DrawnBox one = draw_box(random);
    const std::size_t most = 1 + random() % 3000;
    std::set<BoxIndex> found;
    std::set<BoxIndex> decoded;  // chunks
    for (const Box& piece : pieces_of(one.box, one.stride, one.field, most)) {
      ASSERT_TRUE(is_within(piece, one.dims));
      std::size_t chunk = 1;
      for (const int length : one.field.box_chunk) chunk *= static_cast<std::size_t>(length);
      EXPECT_LE(piece.samples() * one.field.components.size(),
                std::max(most, chunk * one.field.components.size()));
      for (int k = 0; k < piece.count[2]; ++k) {
        for (int j = 0; j < piece.count[1]; ++j) {
          for (int i = 0; i < piece.count[0]; ++i) {
            const BoxIndex at{piece.first[0] + i, piece.first[1] + j, piece.first[2] + k};
            ASSERT_TRUE(found.insert(at).second);
          }
        }
      }
      for (const int z : box_chunks_of(piece, 2, 1, one.field)) {
        for (const int y : box_chunks_of(piece, 1, 1, one.field)) {
          for (const int x : box_chunks_of(piece, 0, 1, one.field)) {
            ASSERT_TRUE(decoded.insert({x, y, z}).second) << "decoded twice";
          }
        }
      }
    }
    for (int k = 0; k < one.box.count[2]; k += one.stride) {
      for (int j = 0; j < one.box.count[1]; ++j) {
        for (int i = 0; i < one.box.count[0]; ++i) {
          ASSERT_TRUE(
              found.count({one.box.first[0] + i, one.box.first[1] + j, one.box.first[2] + k}));
        }
      }
    }
    for (const BoxIndex& at : found) {
      for (std::size_t a = 0; a < 3; ++a) {
        ASSERT_GE(at.at(a), one.box.first.at(a));
        ASSERT_LT(at.at(a), one.box.first.at(a) + one.box.count.at(a));
      }
    }
  }
}

}  // namespace
}  // namespace windsplat::data
