// Weights of values on the edges of a mesh: means at the cells, and vectors from normal components.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "server/data/cf/edges/edges.hpp"
#include "tests/unit/data/cf/edges/edges_maker.hpp"
#include "tests/unit/data/cf/mesh_maker.hpp"

namespace windsplat::data::test::mesh {
namespace {

// n x n squares of the unit square, or their halves, whose nodes are moved by up to `shaken` sizes.
Sides meshed(std::size_t n, Shape shape, double shaken) {
  Sides out;
  std::mt19937 random(11);
  const auto part = [&] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
  const double size = 1 / static_cast<double>(n);
  for (std::size_t k = 0; k < (n + 1) * (n + 1); ++k) {
    out.mesh.x.push_back(size * (static_cast<double>(k % (n + 1)) + 2 * shaken * part()));
    out.mesh.y.push_back(size * (static_cast<double>(k / (n + 1)) + 2 * shaken * part()));
  }
  out.mesh.first.push_back(0);
  const auto add = [&](const std::vector<std::size_t>& corners) {
    for (const std::size_t corner : corners) {
      out.mesh.corners.push_back(static_cast<std::uint32_t>(corner));
    }
    out.mesh.first.push_back(static_cast<std::uint32_t>(out.mesh.corners.size()));
  };
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t low = j * (n + 1) + i;
      const std::size_t high = low + n + 1;
      if (shape == Shape::quads) {
        add({low, low + 1, high + 1, high});
      } else {
        add({low, low + 1, high + 1});
        add({low, high + 1, high});
      }
    }
  }
  out.find();
  return out;
}

struct Errors {
  double largest = 0;
  double rms = 0;
};

// Of the components of the vectors at the cells, or at those with neighbours on all sides.
Errors errors_of(const Sides& sides, const Flow& flow, bool inner_only) {
  const std::vector<float> given = sides.normals_of(flow);
  const cf::EdgeWeights weights(sides.mesh, sides.edges());
  std::array<std::vector<float>, 2> drawn;
  for (auto& one : drawn) one.resize(sides.mesh.cells());
  weights.gather(cf::EdgePart::east, cf::MissingNormal::unknown, given.data(), drawn[0].data());
  weights.gather(cf::EdgePart::north, cf::MissingNormal::unknown, given.data(), drawn[1].data());
  Errors out;
  double squares = 0;
  std::size_t compared = 0;
  for (std::size_t c = 0; c < sides.mesh.cells(); ++c) {
    if (inner_only && !sides.is_inner(c)) continue;
    const auto [x, y] = sides.centroid(c);
    const auto [u, v] = flow(x, y);
    const double to_east = static_cast<double>(drawn[0][c]) - u;
    const double to_north = static_cast<double>(drawn[1][c]) - v;
    out.largest = std::max({out.largest, std::abs(to_east), std::abs(to_north)});
    squares += to_east * to_east + to_north * to_north;
    ++compared;
  }
  out.rms = std::sqrt(squares / static_cast<double>(compared));
  return out;
}

// The order of convergence from 16 to 64 cells along each side.
double order_of(Shape shape, double shaken, const Flow& flow) {
  const double coarse = errors_of(meshed(16, shape, shaken), flow, true).rms;
  const double fine = errors_of(meshed(64, shape, shaken), flow, true).rms;
  EXPECT_LT(coarse, 0.05);
  return std::log(coarse / fine) / std::log(4.0);
}

const Flow constant = [](double, double) { return std::array{3.0, -7.0}; };
const Flow linear = [](double x, double y) {
  return std::array{1 + 2 * x - 3 * y, 5 - x + 0.5 * y};
};
const Flow curved = [](double x, double y) {
  return std::array{std::sin(3 * x) * std::cos(2 * y), std::cos(3 * x + y)};
};

TEST(EdgeWeights, ConstantVectorsAreExact) {
  for (const Shape shape : {Shape::quads, Shape::triangles}) {
    EXPECT_LT(errors_of(meshed(12, shape, 0.3), constant, false).largest, 2e-5);
  }
}

TEST(EdgeWeights, LinearVectorsAreExactInTrianglesAndSquaresAndOfFirstOrderInSkewedCells) {
  EXPECT_LT(errors_of(meshed(12, Shape::triangles, 0.3), linear, true).largest, 2e-5);
  EXPECT_LT(errors_of(meshed(12, Shape::quads, 0), linear, false).largest, 2e-5);
  EXPECT_NEAR(order_of(Shape::quads, 0.2, linear), 1, 0.2);
}

TEST(EdgeWeights, CurvedVectorsAreOfSecondOrderInTrianglesAndSquares) {
  EXPECT_NEAR(order_of(Shape::quads, 0, curved), 2, 0.2);
  EXPECT_NEAR(order_of(Shape::triangles, 0.2, curved), 2, 0.2);
}

TEST(EdgeWeights, MeansOfLinearScalarsAreExactAtCentroids) {
  for (const Shape shape : {Shape::quads, Shape::triangles}) {
    const Sides sides = meshed(10, shape, 0.3);
    cf::MeshEdges edges = sides.edges();
    edges.normals.clear();
    std::vector<float> given;
    for (std::size_t e = 0; e < edges.count; ++e) {
      given.push_back(static_cast<float>(2 * edges.middles[e][0] - 3 * edges.middles[e][1]));
    }
    std::vector<float> drawn(sides.mesh.cells());
    cf::EdgeWeights(sides.mesh, edges)
        .gather(cf::EdgePart::mean, cf::MissingNormal::unknown, given.data(), drawn.data());
    for (std::size_t c = 0; c < drawn.size(); ++c) {
      const auto [x, y] = sides.centroid(c);
      ASSERT_NEAR(drawn[c], 2 * x - 3 * y, 1e-5);
    }
  }
}

// Vectors at the cells along one axis.
std::vector<float> drawn_of(const Sides& sides, const std::vector<float>& given, cf::EdgePart part,
                            cf::MissingNormal missing) {
  std::vector<float> out(sides.mesh.cells());
  cf::EdgeWeights(sides.mesh, sides.edges()).gather(part, missing, given.data(), out.data());
  return out;
}

TEST(EdgeWeights, MissingComponentsOfAirAreLeftOutAndConstantVectorsStayExact) {
  for (const Shape shape : {Shape::quads, Shape::triangles}) {
    const Sides sides = meshed(12, shape, 0.2);
    std::vector<float> given = sides.normals_of(constant);
    for (std::size_t e = 0; e < given.size(); e += 7) {
      given[e] = std::numeric_limits<float>::quiet_NaN();
    }
    const auto east = drawn_of(sides, given, cf::EdgePart::east, cf::MissingNormal::unknown);
    const auto north = drawn_of(sides, given, cf::EdgePart::north, cf::MissingNormal::unknown);
    std::size_t compared = 0;
    for (std::size_t c = 0; c < east.size(); ++c) {
      if (std::isnan(east[c])) continue;
      ASSERT_NEAR(east[c], 3, 1e-4) << c;
      ASSERT_NEAR(north[c], -7, 1e-4) << c;
      ++compared;
    }
    EXPECT_GT(compared, east.size() * 9 / 10);
  }
}

TEST(EdgeWeights, SidesOfOneDirectionDetermineNoVector) {
  const Sides sides = meshed(3, Shape::quads, 0.01);
  std::vector<float> given = sides.normals_of(constant);
  for (const std::size_t side : {1U, 3U}) {
    given[sides.of_corners[side]] = std::numeric_limits<float>::quiet_NaN();
  }
  const auto air = drawn_of(sides, given, cf::EdgePart::north, cf::MissingNormal::unknown);
  EXPECT_TRUE(std::isnan(air[0]));
  EXPECT_NEAR(air[8], -7, 1e-4);
  const auto water = drawn_of(sides, given, cf::EdgePart::north, cf::MissingNormal::wall);
  EXPECT_NEAR(water[0], -7, 0.3);
}

TEST(EdgeWeights, MissingComponentsOfWaterAreWallsAndCellsWithoutAnyAreMasked) {
  const Sides sides = meshed(3, Shape::quads, 0);
  std::vector<float> given = sides.normals_of(constant);
  std::vector<float> scalars(given.size(), 6);
  const auto lose = [&](std::size_t cell, std::size_t side) {
    const std::uint32_t edge = sides.of_corners[4 * cell + side];
    given[edge] = std::numeric_limits<float>::quiet_NaN();
    scalars[edge] = given[edge];
  };
  lose(0, 3);  // the left side of the first cell
  for (std::size_t side = 0; side < 4; ++side) lose(8, side);
  const auto wall = cf::MissingNormal::wall;
  const auto east = drawn_of(sides, given, cf::EdgePart::east, wall);
  const auto mean = drawn_of(sides, scalars, cf::EdgePart::mean, wall);
  EXPECT_NEAR(east[0], 1.5, 1e-5);
  EXPECT_NEAR(east[4], 3, 1e-5);
  EXPECT_NEAR(mean[0], 6, 1e-5);
  EXPECT_TRUE(std::isnan(east[8]));
  EXPECT_TRUE(std::isnan(mean[8]));
}

TEST(EdgeWeights, TrianglesWithoutValuesAtTheirOwnSidesAreMasked) {
  const Sides sides = meshed(4, Shape::triangles, 0);
  std::vector<float> given = sides.normals_of(constant);
  constexpr std::size_t inner = 12;
  ASSERT_TRUE(sides.is_inner(inner));
  for (std::size_t side = 0; side < 3; ++side) {
    given[sides.of_corners[3 * inner + side]] = std::numeric_limits<float>::quiet_NaN();
  }
  const auto east = drawn_of(sides, given, cf::EdgePart::east, cf::MissingNormal::unknown);
  EXPECT_TRUE(std::isnan(east[inner]));
  EXPECT_EQ(std::count_if(east.begin(), east.end(), [](float u) { return std::isnan(u); }), 1);
}

}  // namespace
}  // namespace windsplat::data::test::mesh
