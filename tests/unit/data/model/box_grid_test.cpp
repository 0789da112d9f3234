// Boxes of a grid: their places in volumes, their keys, and what they hold.
#include "server/data/model/box_grid.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <set>
#include <vector>

#include "server/data/model/middles.hpp"

namespace windsplat::data {
namespace {

constexpr std::array<int, 3> grid_dims{21, 12, 9};
constexpr std::array<int, 3> box_size{8, 4, 8};

// Two rows that touch, and one at the end of the data, of which little is there.
BoxGrid three_boxes() {
  return grid_of({{{8, 8, 0}, box_size}, {{16, 8, 8}, {5, 4, 1}}, {{8, 4, 0}, box_size}}, box_size,
                 grid_dims);
}

TEST(BoxGrid, HoldsTheSamplesOfItsBoxesOnceEach) {
  const BoxGrid grid = three_boxes();
  EXPECT_EQ(grid.bounds, (Box{{8, 4, 0}, {13, 8, 9}}));
  EXPECT_EQ(grid.count, (std::array{2, 2, 2}));
  EXPECT_EQ(grid.held, 3);
  EXPECT_EQ(dims_of(grid), (std::array{8, 4, 32}));
  const std::size_t masked = 8 * 4 * 8;
  std::set<std::size_t> seen;
  for (int z = 0; z < 9; ++z) {
    for (int y = 4; y < 12; ++y) {
      for (int x = 8; x < 21; ++x) {
        const std::size_t number = grid.number_of({x, y, z});
        const bool held = (x < 16 && z < 8) || (x >= 16 && y >= 8 && z == 8);
        EXPECT_EQ(number >= masked, held) << x << ' ' << y << ' ' << z;
        if (held) seen.insert(number);
        EXPECT_LT(number, samples_of(grid));
      }
    }
  }
  EXPECT_EQ(seen.size(), 2 * masked + 5 * 4);
  // x is fastest, then y.
  EXPECT_EQ(grid.number_of({9, 4, 0}), grid.number_of({8, 4, 0}) + 1);
  EXPECT_EQ(grid.number_of({8, 5, 0}), grid.number_of({8, 4, 0}) + 8);
  EXPECT_EQ(grid.number_of({8, 4, 1}), grid.number_of({8, 4, 0}) + 32);
}

TEST(BoxGrid, BoxesAreInTheOrderOfTheirPlaces) {
  const BoxGrid grid = three_boxes();
  const std::vector<Box> boxes = grid.boxes();
  ASSERT_EQ(boxes.size(), 3U);
  EXPECT_EQ(boxes[2], (Box{{16, 8, 8}, {5, 4, 1}}));
  for (std::size_t n = 0; n < boxes.size(); ++n) {
    EXPECT_EQ(grid.number_of(boxes[n].first), (n + 1) * 8 * 4 * 8);
  }
}

TEST(BoxGrid, OfKernelsHoldsTheKernelsOfTheSamples) {
  const BoxGrid grid = three_boxes();
  for (const int stride : {2, 4}) {
    const BoxGrid kernels = strided_grid(grid, stride);
    const auto boxes = kernels.boxes();
    for (std::size_t n = 0; n < boxes.size(); ++n) {
      EXPECT_EQ(boxes[n], strided_box(grid.boxes()[n], stride)) << stride;
    }
    for (const std::array<int, 3> at : {std::array{8, 4, 0}, {15, 11, 7}, {20, 9, 8}, {20, 4, 8}}) {
      EXPECT_EQ(grid.number_of(at, stride),
                kernels.number_of({at[0] / stride, at[1] / stride, at[2] / stride}));
    }
  }
}

TEST(BoxGrid, KeysTellTheBoxes) {
  const BoxGrid grid = three_boxes();
  const std::string key = key_of(grid);
  ASSERT_TRUE(grid_of_key(key));
  EXPECT_EQ(*grid_of_key(key), grid);
  EXPECT_NE(key_of(grid_of({{{8, 8, 0}, box_size}}, box_size, grid_dims)), key);
  EXPECT_FALSE(box_of(key));
  EXPECT_FALSE(grid_of_key(key_of(grid.bounds)));
  for (const char* other :
       {"", "g", "g8,4,0,13,8,9", "g8,4,0,13,8,9,8,4,8,9", "g8,4,0,13,8,9,0,4,8",
        "g8,4,0,13,8,9,8,4,8,0-", "g8,4,0,13,8,9,8,4,8;0"}) {
    EXPECT_FALSE(grid_of_key(other)) << other;
  }
}

TEST(BoxGrid, IsHeldByOneThatHasAllOfItsBoxes) {
  const BoxGrid grid = three_boxes();
  const BoxGrid one = grid_of({{{8, 8, 0}, box_size}}, box_size, grid_dims);
  const BoxGrid beside = grid_of({{{0, 8, 0}, box_size}}, box_size, grid_dims);
  const BoxGrid between = grid_of({{{16, 8, 0}, box_size}}, box_size, grid_dims);
  const BoxGrid wider = grid_of({{{8, 8, 0}, {16, 4, 8}}}, {16, 4, 8}, grid_dims);
  EXPECT_TRUE(is_held_by(one, grid));
  EXPECT_FALSE(is_held_by(grid, one));
  EXPECT_FALSE(is_held_by(beside, grid)) << "beyond the bounds";
  EXPECT_FALSE(is_held_by(between, grid)) << "within the bounds";
  EXPECT_FALSE(is_held_by(one, wider)) << "of another size";
}

}  // namespace
}  // namespace windsplat::data
