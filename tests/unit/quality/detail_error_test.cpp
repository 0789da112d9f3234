#include "server/quality/detail_error.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace windsplat::quality {
namespace {

// Level n has cells of 2^n samples, so that its error is coefficient (2^(order n) - 1), of one
// shape throughout.
double error_of_order(double order, int level) { return std::exp2(order * level) - 1; }

LevelDifferences differences_of_order(double order, int level) {
  const double near = error_of_order(order, level + 1) - error_of_order(order, level);
  const double far = error_of_order(order, level + 2) - error_of_order(order, level + 1);
  return {near * near, far * far, near * far};
}

TEST(DetailErrorOf, ErrorsOfOneOrderIsExact) {
  for (const double order : {0.5, 1.0, 2.0}) {
    for (const int level : {1, 2, 5}) {
      const DetailError found = detail_error(differences_of_order(order, level), level);
      EXPECT_NEAR(found.error, error_of_order(order, level), 1e-12 * found.error) << order;
      EXPECT_NEAR(found.growth, std::exp2(order), 1e-12);
    }
  }
}

// Of each group of 8^n lines one is drawn for all: the variance of a pixel is 8^n times that of a
// line, and pictures of two levels are independent.
TEST(DetailErrorOf, LinesDrawnByChanceIsThatOfTheirVariance) {
  for (const int level : {2, 3, 5}) {
    const double variance = std::pow(8, level);
    const double near = 9 * variance;
    const double far = 72 * variance;
    const DetailError found = detail_error({near, far, -8 * variance}, level);
    EXPECT_NEAR(found.error, std::sqrt(variance), 0.02 * std::sqrt(variance));
  }
}

TEST(DetailErrorOf, EqualPicturesOrTheFinestLevelIsNone) {
  EXPECT_EQ(detail_error({0, 0, 0}, 3).error, 0);
  EXPECT_EQ(detail_error({0, 1, 0}, 3).error, 0);
  EXPECT_EQ(detail_error({1, 4, 2}, 0).error, 0);
}

TEST(DetailErrorOf, DifferencesThatHardlyGrowIsLarge) {
  // Coarse pictures that show nothing of the data do not promise an error below their difference.
  const DetailError found = detail_error({1, 0.25, 0.5}, 3);
  EXPECT_GT(found.error, 2);
  EXPECT_GE(found.growth, 1.2);
}

TEST(DetailErrorOf, OtherLevelsGrowsWithTheirHalvings) {
  const DetailError known{0.01, 2, {2, 2, 2}};
  EXPECT_DOUBLE_EQ(error_at(known, {2, 2, 2}), 0.01);
  EXPECT_DOUBLE_EQ(error_at(known, {4, 4, 4}), 0.04);
  EXPECT_DOUBLE_EQ(error_at(known, {1, 1, 1}), 0.005);
  EXPECT_DOUBLE_EQ(error_at(known, {7, 7, 7}), 0.32);
  EXPECT_DOUBLE_EQ(error_at(known, {30, 30, 30}), 1);
}

}  // namespace
}  // namespace windsplat::quality
