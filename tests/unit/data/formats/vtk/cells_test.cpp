// The oblique box of a cell compared with the cell itself: the box contains the whole cell.
#include "server/data/formats/vtk/cells.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace windsplat::data::vtk {
namespace {

constexpr std::array shapes{Shape::triangle, Shape::quad,  Shape::tetra,
                            Shape::pyramid,  Shape::wedge, Shape::hexahedron};

// The unit cell of a shape: rotated, stretched, moved far away, with perturbed corners.
class Distorted {
 public:
  explicit Distorted(unsigned seed) : random_(seed) {}

  Corners cell(Shape shape) {
    const Corners unit = unit_cell(shape);
    const double scale = std::pow(10, uniform(-3, 3));
    const double thickness = std::pow(10, uniform(-9, 0));
    const double knock = uniform(0, 1) < 0.5 ? 0 : uniform(0, 0.6);
    const double distance = uniform(0, 1) < 0.5 ? 0 : scale * std::pow(10, uniform(0, 7));
    std::array<Point, 3> map{};
    for (Point& column : map) {
      for (double& part : column) part = scale * uniform(-1, 1);
    }
    for (double& part : map[2]) part *= thickness;
    const bool flat = dimension_of(shape) == 2;
    Corners out{};
    for (std::size_t i = 0; i < static_cast<std::size_t>(corners_of(shape)); ++i) {
      Point at = unit[i];
      for (double& part : at) part += knock * uniform(-1, 1);
      for (std::size_t d = 0; d < (flat ? 2U : 3U); ++d) {
        out[i][d] = distance + map[0][d] * at[0] + map[1][d] * at[1] + map[2][d] * at[2];
      }
    }
    return out;
  }

  double uniform(double low, double high) {
    return std::uniform_real_distribution(low, high)(random_);
  }

 private:
  static Corners unit_cell(Shape shape) {
    switch (shape) {
      case Shape::wedge:
        return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}}};
      case Shape::tetra:
        return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
      case Shape::pyramid:
        return {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}}};
      case Shape::triangle:
        return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
      default:
        return {{{0, 0, 0},
                 {1, 0, 0},
                 {1, 1, 0},
                 {0, 1, 0},
                 {0, 0, 1},
                 {1, 0, 1},
                 {1, 1, 1},
                 {0, 1, 1}}};
    }
  }

  std::mt19937 random_;
};

TEST(VtkCells, PointsFoundInACellAreInItsObliqueBox) {
  Distorted distorted(7);
  constexpr std::size_t row = 16;
  std::size_t found = 0;
  std::size_t left_out = 0;
  std::uint64_t steps = 0;
  for (int turn = 0; turn < 600; ++turn) {
    const Shape shape = shapes.at(static_cast<std::size_t>(turn) % shapes.size());
    const Corners corners = distorted.cell(shape);
    const auto count = static_cast<std::size_t>(corners_of(shape));
    const SlantedBox box(shape, corners);
    // Rows over the box of the cell, with y and z of random points inside.
    Point low = corners[0];
    Point high = corners[0];
    for (std::size_t i = 1; i < count; ++i) {
      for (std::size_t d = 0; d < 3; ++d) {
        low[d] = std::min(low[d], corners[i][d]);
        high[d] = std::max(high[d], corners[i][d]);
      }
    }
    const double step = (high[0] - low[0]) / (row - 1);
    for (int r = 0; r < 8; ++r) {
      Point from = low;
      for (std::size_t d = 1; d < 3; ++d) {
        if (high[d] > low[d]) from[d] = distorted.uniform(low[d], high[d]);
      }
      const auto [first, last] = box.along_row(from, step, row);
      ASSERT_LE(first, last);
      ASSERT_LE(last, row);
      left_out += row - (last - first);
      for (std::size_t i = 0; i < row; ++i) {
        const Point place{from[0] + step * static_cast<double>(i), from[1], from[2]};
        CellPlace where;
        steps = 0;
        if (!find_in_cell(shape, corners, place, where, steps)) continue;
        ++found;
        ASSERT_GE(steps, 1U);
        ASSERT_LE(steps, 22U);
        ASSERT_TRUE(i >= first && i < last) << "turn " << turn << ", row " << r << ", place " << i;
      }
    }
  }
  EXPECT_GT(found, 4'000U);
  EXPECT_GT(left_out, 20'000U);
}

// A plate along the diagonal of x and z, a hundredth thick: of a row along x the box contains only
// that thickness times the square root of two.
TEST(VtkCells, ObliquePlateLeavesTheRestEmpty) {
  const double t = 0.01 / std::numbers::sqrt2;
  Corners corners{};
  for (std::size_t i = 0; i < 8; ++i) {
    const double along = i == 1 || i == 2 || i == 5 || i == 6 ? 1 : 0;
    const double y = i == 2 || i == 3 || i == 6 || i == 7 ? 1 : 0;
    const double up = i >= 4 ? 1 : 0;
    corners[i] = {along - up * t, y, along + up * t};
  }
  const SlantedBox box(Shape::hexahedron, corners);
  const auto [first, last] = box.along_row({0, 0.5, 0.5}, 1e-4, 10'001);
  // From x = z - 2 t to x = z.
  EXPECT_EQ(first, 4859U);
  EXPECT_EQ(last, 5001U);
  EXPECT_EQ(box.along_row({0, 1.5, 0.5}, 1e-4, 10'001)[1], 0U);
}

}  // namespace
}  // namespace windsplat::data::vtk
