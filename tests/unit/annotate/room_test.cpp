// Which parts of a picture are taken, against a search of all rectangles.
#include "server/annotate/room.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace windsplat::annotate {
namespace {

// Rectangles of all sizes, also beyond the edges of the picture, against each of the others.
TEST(Occupied, MeetsWhatOneOfItsRectanglesOverlaps) {
  Figure figure;
  figure.width = 300;
  figure.height = 170;
  unsigned state = 7;
  const auto random = [&state](double most) {
    state = state * 1664525U + 1013904223U;
    return most * (state >> 8U) / (1U << 24U);
  };
  const auto rectangle = [&](double most) {
    const Point low{random(340) - 20, random(210) - 20};
    return Rectangle{low, {low.x + random(most), low.y + random(most)}};
  };
  figure.taken.push_back({{0, 100}, {160, 170}});
  for (const double cell : {9.0, 40.0, 1000.0}) {
    std::vector<Rectangle> all = figure.taken;
    Occupied occupied(figure, cell);
    int met = 0;
    for (int n = 0; n < 400; ++n) {
      const Rectangle one = rectangle(30);
      const bool meets = std::any_of(all.begin(), all.end(), [&one](const Rectangle& b) {
        return one.low.x < b.high.x && b.low.x < one.high.x && one.low.y < b.high.y &&
               b.low.y < one.high.y;
      });
      ASSERT_EQ(occupied.meets(one), meets) << cell << ' ' << n;
      met += meets ? 1 : 0;
      if (n % 4 != 0) continue;
      const Rectangle added = rectangle(12);
      all.push_back(added);
      occupied.add(added);
    }
    EXPECT_GT(met, 40);
    EXPECT_LT(met, 360);
  }
}

}  // namespace
}  // namespace windsplat::annotate
