// Points and columns in polygons, against winding numbers, formulas and counting.
#include "server/scene/region/polygon.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "server/scene/region/select.hpp"
#include "tests/unit/scene/earth.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using data::AxisKind;
using protocol::RegionView;
using ::testing::ElementsAre;

// The winding number by the sum of angles, for points that are not on an edge.
int winding(const Ring& ring, const std::array<double, 2>& p) {
  double sum = 0;
  for (std::size_t n = 1; n < ring.size(); ++n) {
    const double ax = ring[n - 1][0] - p[0];
    const double ay = ring[n - 1][1] - p[1];
    const double bx = ring[n][0] - p[0];
    const double by = ring[n][1] - p[1];
    sum += std::atan2(ax * by - ay * bx, ax * bx + ay * by);
  }
  return static_cast<int>(std::lround(sum / (2 * std::numbers::pi)));
}

// A star of random radii about the origin.
Ring star(std::mt19937& random, int points, double least, double most) {
  std::uniform_real_distribution<double> radius(least, most);
  Ring ring;
  for (int n = 0; n < points; ++n) {
    const double angle = 2 * std::numbers::pi * n / points;
    const double r = radius(random);
    ring.push_back({r * std::cos(angle), r * std::sin(angle)});
  }
  ring.push_back(ring.front());
  return ring;
}

TEST(Polygon, ContainsThePointsOfOddWindingNumber) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-2.5, 2.5);
  int inside_count = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const Polygon polygon{star(random, 5 + trial, 1, 2), star(random, 3 + trial, 0.2, 0.9)};
    const Inside inside({polygon});
    for (int n = 0; n < 200; ++n) {
      const std::array p{place(random), place(random)};
      const int windings = winding(polygon[0], p) + winding(polygon[1], p);
      EXPECT_EQ(inside.contains(p[0], p[1]), windings % 2 != 0) << p[0] << ' ' << p[1];
      inside_count += windings % 2 != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(inside_count, 1000);
}

// Rays through vertices: a lattice of points against a polygon whose vertices lie on it.
TEST(Polygon, VerticesAndEdgesOnTheRowsOfPointsAreExact) {
  const Ring diamond{{0, -3}, {3, 0}, {0, 3}, {-3, 0}, {0, -3}};
  const Ring notch{{1, 0}, {4, 1}, {4, -1}, {1, 0}};
  const Inside inside({{diamond}});
  const Inside with_notch({{diamond, notch}});
  for (int y = -5; y <= 5; ++y) {
    for (int x = -5; x <= 5; ++x) {
      const bool in_diamond = std::abs(x) + std::abs(y) <= 3;
      EXPECT_EQ(inside.contains(x, y), in_diamond) << x << ' ' << y;
      if (y == 0 && x > 1 && x < 3) {
        EXPECT_FALSE(with_notch.contains(x, y)) << x;
      }
    }
  }
  EXPECT_FALSE(with_notch.contains(2, 0)) << "a hole within";
  EXPECT_TRUE(with_notch.contains(1, 0)) << "a vertex belongs to it";
}

TEST(Polygon, AreaByCountingColumnsIsThatOfTheFormula) {
  const Ring outer{{-50, -40}, {60, -30}, {40, 50}, {-30, 60}, {-50, -40}};
  const Ring hole{{-10, -10}, {10, -10}, {10, 10}, {-10, 10}, {-10, -10}};
  double twice = 0;
  for (std::size_t n = 1; n < outer.size(); ++n) {
    twice += outer[n - 1][0] * outer[n][1] - outer[n][0] * outer[n - 1][1];
  }
  const double area = 0.5 * twice - 400;
  data::Grid grid;
  constexpr double step = 0.25;
  grid.axes = {axis(AxisKind::longitude, "degrees_east", evenly(-179.9, step, 1440)),
               axis(AxisKind::latitude, "degrees_north", evenly(-89.9, step, 719)),
               axis(AxisKind::level, "", {0})};
  RegionView region;
  region.polygon = {{outer, hole}};
  const auto crop = crop_of(region, grid, 0);
  ASSERT_TRUE(crop && crop->columns);
  double count = 0;
  for (const unsigned char kept : *crop->columns) count += kept;
  const double boundary = 500;  // length of all edges, degrees
  EXPECT_NEAR(count * step * step, area, boundary * step * 0.1);
  EXPECT_NEAR(crop->count[0] * step, 110, 2 * step);
  EXPECT_NEAR(crop->count[1] * step, 100, 2 * step);
}

TEST(Polygon, LongitudesAreThoseOfAnyTurnAndMayCrossTheSeam) {
  for (const double turn : {-360.0, 0.0, 360.0}) {
    RegionView region;
    region.polygon = {
        {{{turn - 25, -5}, {turn + 15, -5}, {turn + 15, 25}, {turn - 25, 25}, {turn - 25, -5}}}};
    const auto crop = crop_of(region, whole_earth(), 0);
    ASSERT_TRUE(crop);
    EXPECT_THAT(crop->first, ElementsAre(34, 8, 0));
    EXPECT_THAT(crop->count, ElementsAre(4, 3, 3));
    EXPECT_FALSE(crop->columns) << "a rectangle masks nothing";
  }
}

TEST(Polygon, LongitudesBeyondTwoTurnsAreRefused) {
  RegionView region;
  region.polygon = {{{{0, 0}, {1e30, 0}, {10, 20}, {0, 0}}}};
  const auto crop = crop_of(region, whole_earth(), 0);
  ASSERT_FALSE(crop);
  EXPECT_EQ(crop.error().at.front().pointer, "/region/polygon");
  EXPECT_THAT(crop.error().message, ::testing::HasSubstr("-720 to 720"));
}

// Two islands on both sides of the antimeridian, cut as RFC 7946 (section 3.1.9) recommends.
TEST(Polygon, SeveralPolygonsAreUnited) {
  RegionView region;
  region.polygon = {{{{165, 0}, {180, 0}, {180, 20}, {165, 20}, {165, 0}}},
                    {{{-180, 0}, {-165, 0}, {-165, 20}, {-180, 20}, {-180, 0}}}};
  const auto crop = crop_of(region, whole_earth(), 0);
  ASSERT_TRUE(crop);
  EXPECT_EQ(crop->first[0], 17);
  EXPECT_EQ(crop->count[0], 3);
  EXPECT_FALSE(crop->columns);
}

}  // namespace
}  // namespace windsplat::scene
