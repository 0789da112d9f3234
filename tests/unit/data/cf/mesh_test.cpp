// Meshes of polygons in memory: outlines, lattices, weights; closed forms of linear functions.
#include "server/data/cf/mesh/mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "server/data/cf/mesh/accuracy.hpp"
#include "server/data/cf/mesh/lattice.hpp"
#include "server/data/cf/mesh/topology.hpp"
#include "server/data/cf/mesh/weights.hpp"

namespace windsplat::data::cf {
namespace {

constexpr std::size_t many = std::size_t{1} << 31;  // samples

using Function = std::function<double(double, double)>;

void add_polygon(Mesh& mesh, const std::vector<std::uint32_t>& nodes) {
  if (mesh.first.empty()) mesh.first.push_back(0);
  mesh.corners.insert(mesh.corners.end(), nodes.begin(), nodes.end());
  mesh.first.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
}

// Numbers in [-1, 1] without a pattern.
double scatter_of(std::size_t n) { return std::sin(12.9898 * static_cast<double>(n) + 4.1); }

// n x n quadrilaterals of a unit square, each node moved by up to `moved` cells; every third
// quadrilateral is two triangles, every seventh pair of neighbours a hexagon.
Mesh mixed_square(std::uint32_t n, double moved) {
  Mesh mesh;
  for (std::uint32_t j = 0; j <= n; ++j) {
    for (std::uint32_t i = 0; i <= n; ++i) {
      const bool inside = i > 0 && j > 0 && i < n && j < n;
      const double by = inside ? moved / n : 0;
      mesh.x.push_back(static_cast<double>(i) / n + by * scatter_of(2 * mesh.x.size()));
      mesh.y.push_back(static_cast<double>(j) / n + by * scatter_of(2 * mesh.y.size() + 1));
    }
  }
  for (std::uint32_t j = 0; j < n; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t a = j * (n + 1) + i;
      const std::uint32_t above = a + n + 1;
      if ((i + j) % 7 == 0 && i + 1 < n) {
        add_polygon(mesh, {a, a + 1, a + 2, above + 2, above + 1, above});
        ++i;
      } else if ((i + j) % 3 == 0) {
        add_polygon(mesh, {a, a + 1, above + 1});
        add_polygon(mesh, {a, above + 1, above});
      } else {
        add_polygon(mesh, {above, above + 1, a + 1, a});  // clockwise
      }
    }
  }
  return mesh;
}

// Rings of quadrilaterals around the globe; at each pole a fan of triangles or one polygon.
Mesh globe(std::uint32_t columns, std::uint32_t rows, bool fans) {
  Mesh mesh;
  mesh.on_sphere = true;
  for (std::uint32_t j = 1; j < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      mesh.x.push_back(-170.0 + 360.0 * i / columns + 3 * scatter_of(mesh.x.size()));
      mesh.y.push_back(-90.0 + 180.0 * j / rows);
    }
  }
  const auto node = [&](std::uint32_t i, std::uint32_t j) {
    return (j - 1) * columns + i % columns;
  };
  for (std::uint32_t j = 1; j + 1 < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      add_polygon(mesh, {node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)});
    }
  }
  for (const bool north : {false, true}) {
    const std::uint32_t j = north ? rows - 1 : 1;
    std::vector<std::uint32_t> ring;
    for (std::uint32_t i = 0; i < columns; ++i) ring.push_back(node(i, j));
    if (!fans) {
      add_polygon(mesh, ring);
      continue;
    }
    mesh.x.push_back(77);  // any longitude
    mesh.y.push_back(north ? 90 : -90);
    const auto pole = static_cast<std::uint32_t>(mesh.x.size() - 1);
    for (std::uint32_t i = 0; i < columns; ++i) {
      add_polygon(mesh, {ring[i], ring[(i + 1) % columns], pole});
    }
  }
  return mesh;
}

struct Resampled {
  Mesh mesh;
  MeshLattice lattice;
  CellsOfSamples cells;
  std::vector<float> values;

  [[nodiscard]] std::array<double, 2> place(std::size_t n) const {
    return {lattice.x.at(n % lattice.x.count), lattice.y.at(n / lattice.x.count)};
  }
};

Resampled located(Mesh mesh) {
  Resampled out{std::move(mesh), {}, {}, {}};
  auto lattice = lattice_of(out.mesh, many);
  EXPECT_TRUE(lattice);
  out.lattice = *lattice;
  auto cells = find_cells(out.mesh, out.lattice);
  EXPECT_TRUE(cells);
  out.cells = *cells;
  return out;
}

std::array<double, 2> center_of(const Mesh& mesh, std::size_t cell) {
  Outline outline;
  outline_of(mesh, cell, outline);
  ChartCell chart;
  chart_of(mesh, cell, outline.polar, chart);
  return chart.in_plane(chart.centroid());
}

void draw(Resampled& on, MeshLocation location, const std::vector<float>& values) {
  MeshWeights weights(on.mesh, on.lattice, on.cells.cells, location);
  on.values.resize(on.lattice.samples());
  weights.gather(values.data(), on.values.data());
}

Resampled drawn(Mesh mesh, MeshLocation location, const Function& f) {
  Resampled out = located(std::move(mesh));
  std::vector<float> values;
  if (location == MeshLocation::node) {
    for (std::size_t n = 0; n < out.mesh.nodes(); ++n) {
      values.push_back(static_cast<float>(f(out.mesh.x[n], out.mesh.y[n])));
    }
  } else {
    for (std::size_t c = 0; c < out.mesh.cells(); ++c) {
      const auto [x, y] = center_of(out.mesh, c);
      values.push_back(static_cast<float>(f(x, y)));
    }
  }
  draw(out, location, values);
  return out;
}

// The largest and the rms error of samples at which `counts` is true.
std::array<double, 2> errors(const Resampled& on, const Function& f,
                             const std::function<bool(double, double)>& counts) {
  double most = 0;
  double squares = 0;
  std::size_t samples = 0;
  for (std::size_t n = 0; n < on.values.size(); ++n) {
    const auto [x, y] = on.place(n);
    if (!counts(x, y)) continue;
    const double error = std::abs(static_cast<double>(on.values[n]) - f(x, y));
    EXPECT_FALSE(std::isnan(error)) << x << ' ' << y;
    most = std::max(most, error);
    squares += error * error;
    ++samples;
  }
  return {most, std::sqrt(squares / static_cast<double>(samples))};
}

constexpr auto everywhere = [](double, double) { return true; };
constexpr auto amid = [](double x, double y) { return x > 0.2 && x < 0.8 && y > 0.2 && y < 0.8; };
double wave(double x, double y) { return std::sin(4 * x + 1) * std::cos(3 * y); }

TEST(MeshLattice, ItIsAsFineAsTheCells) {
  const Resampled on = located(mixed_square(60, 0.2));
  EXPECT_EQ(on.cells.inside, on.lattice.samples());
  EXPECT_EQ(on.cells.twice, 0U);
  const double per_cell =
      static_cast<double>(on.cells.inside) / static_cast<double>(on.mesh.cells());
  EXPECT_GT(per_cell, 1.5);
  EXPECT_LT(per_cell, 3.0);
  EXPECT_NEAR(on.lattice.x.spacing, on.lattice.y.spacing, 0.02 * on.lattice.y.spacing);
}

TEST(MeshLattice, SmallCellsAreLimitedToSixteenSamplesForACell) {
  // All but a few cells lie in a hundredth of the width.
  Mesh mesh = mixed_square(100, 0);
  for (double& x : mesh.x) x = x < 0.95 ? x / 100 : x;
  for (double& y : mesh.y) y = y < 0.95 ? y / 100 : y;
  const Resampled on = located(std::move(mesh));
  EXPECT_TRUE(on.lattice.is_coarse);
  EXPECT_LE(static_cast<double>(on.lattice.samples()), 16.1 * static_cast<double>(on.mesh.cells()));
  EXPECT_LT(on.cells.hit, on.mesh.cells() / 10);
}

TEST(MeshLattice, ItHasNoMoreSamplesThanAllowed) {
  Mesh mesh = mixed_square(60, 0.2);
  const auto lattice = lattice_of(mesh, 2000);
  ASSERT_TRUE(lattice);
  EXPECT_TRUE(lattice->is_coarse);
  EXPECT_GT(lattice->samples(), 1900U);
  EXPECT_LE(lattice->samples(), 2000U);
}

TEST(MeshLattice, ThinStripsHaveNoMoreSamplesThanAllowed) {
  for (const auto& [width, height, on_sphere] :
       {std::tuple(360.0, 1e-11, true), {1e11, 1e-11, false}, {1e-11, 1e11, false}}) {
    Mesh mesh = mixed_square(4, 0);
    mesh.on_sphere = on_sphere;
    for (double& x : mesh.x) x = width * (x - 0.5);
    for (double& y : mesh.y) y *= height;
    const auto lattice = lattice_of(mesh, many);
    ASSERT_TRUE(lattice);
    EXPECT_LE(lattice->samples(), samples_of_small_mesh) << width;
    EXPECT_GT(lattice->samples(), samples_of_small_mesh / 2) << width;
  }
}

TEST(MeshLattice, CellsWhoseSizeIsBelowEveryFloatHaveNoArea) {
  for (const bool on_sphere : {false, true}) {
    Mesh mesh = mixed_square(4, 0);
    mesh.on_sphere = on_sphere;
    for (double& x : mesh.x) x *= 1e-160;
    for (double& y : mesh.y) y *= 1e-160;
    const auto lattice = lattice_of(mesh, many);
    ASSERT_FALSE(lattice) << on_sphere;
    EXPECT_EQ(lattice.error().message, "no cell of the mesh has an area");
  }
}

TEST(MeshLattice, SamplesOnEdgesAndNodesBelongToOneCell) {
  // Rows and columns of the lattice lie on the edges.
  const Mesh mesh = mixed_square(8, 0);
  MeshLattice lattice;
  lattice.x = {0.0625, 0.0625, 15};
  lattice.y = {0.0625, 0.0625, 15};
  const auto cells = find_cells(mesh, lattice);
  ASSERT_TRUE(cells);
  EXPECT_EQ(cells->inside, 225U);
  EXPECT_EQ(cells->twice, 0U);
}

TEST(MeshLattice, TheGlobeIsCoveredOnceWithPolesAsCornersOrWithinCells) {
  for (const bool fans : {false, true}) {
    const Resampled on = located(globe(40, 20, fans));
    EXPECT_TRUE(on.lattice.closes);
    EXPECT_DOUBLE_EQ(on.lattice.x.spacing * static_cast<double>(on.lattice.x.count), 360);
    EXPECT_NEAR(on.lattice.y.first - on.lattice.y.spacing / 2, -90, 1e-9);
    EXPECT_EQ(on.cells.inside, on.lattice.samples()) << fans;
    EXPECT_EQ(on.cells.twice, 0U) << fans;
    EXPECT_GT(on.cells.hit, on.mesh.cells() * 98 / 100) << fans;
  }
}

TEST(MeshLattice, APartOfTheGlobeAcrossTheDateLineIsInOnePiece) {
  Mesh mesh = mixed_square(30, 0.2);
  mesh.on_sphere = true;
  for (double& x : mesh.x) x = std::remainder(172 + 20 * x, 360.0);
  for (double& y : mesh.y) y = 30 + 10 * y;
  const Resampled on = located(std::move(mesh));
  EXPECT_FALSE(on.lattice.closes);
  EXPECT_EQ(on.cells.inside, on.lattice.samples());
  EXPECT_NEAR(on.lattice.x.at(0), 172, 0.5);
  EXPECT_NEAR(on.lattice.x.at(on.lattice.x.count - 1), 192, 0.5);
  // Equal lengths in both directions at the latitude nearest to the equator.
  EXPECT_NEAR(on.lattice.x.spacing * std::cos(30 * std::numbers::pi / 180), on.lattice.y.spacing,
              0.03 * on.lattice.y.spacing);
}

TEST(MeshLattice, ACornerOnThePoleHasAnyLongitude) {
  Mesh mesh;
  mesh.on_sphere = true;
  mesh.x = {10, 20, 77};
  mesh.y = {60, 60, 90};
  add_polygon(mesh, {0, 1, 2});
  const Resampled on = located(std::move(mesh));
  EXPECT_FALSE(on.lattice.closes);
  EXPECT_NEAR(on.lattice.x.at(0), 10, 0.5);
  EXPECT_NEAR(on.lattice.x.at(on.lattice.x.count - 1), 20, 0.5);
  EXPECT_EQ(on.cells.inside, on.lattice.samples());  // both sides are meridians
}

TEST(MeshLattice, CellsThatOverlapWithoutBoundAreRefused) {
  Mesh mesh;
  mesh.x = {0, 1, 1, 0, 0.001, 0.001};
  mesh.y = {0, 0, 1, 1, 0, 0.001};
  for (int n = 0; n < 10000; ++n) add_polygon(mesh, {0, 4, 5});
  for (int n = 0; n < 9000; ++n) add_polygon(mesh, {0, 1, 2, 3});
  auto lattice = lattice_of(mesh, many);
  ASSERT_TRUE(lattice);
  const auto cells = find_cells(mesh, *lattice);
  ASSERT_FALSE(cells);
  EXPECT_NE(cells.error().message.find("overlap"), std::string::npos);
}

TEST(MeshWeights, LinearFunctionsOfNodesAreExact) {
  const auto f = [](double x, double y) { return 3 - 2 * x + 5 * y; };
  const Resampled on = drawn(mixed_square(25, 0.25), MeshLocation::node, f);
  EXPECT_LT(errors(on, f, everywhere)[0], 2e-6);
}

TEST(MeshWeights, LinearFunctionsOfLongitudeAndLatitudeAreExactAcrossTheDateLine) {
  Mesh mesh = mixed_square(25, 0.1);
  mesh.on_sphere = true;
  for (double& x : mesh.x) x = std::remainder(175 + 10 * x, 360.0);
  for (double& y : mesh.y) y = -50 + 20 * y;
  const auto f = [](double x, double y) { return 0.1 * (x < 0 ? x + 360 : x) - 0.3 * y; };
  for (const auto location : {MeshLocation::node, MeshLocation::face}) {
    const Resampled on = drawn(mesh, location, f);
    const auto inside = [](double x, double y) { return x > 176 && x < 184 && y > -48 && y < -32; };
    EXPECT_LT(errors(on, f, inside)[0], 2e-5);
  }
}

TEST(MeshWeights, ConstantsOfCellsAreExactEverywhere) {
  for (const bool fans : {false, true}) {
    const auto f = [](double, double) { return 0.1; };
    const Resampled on = drawn(globe(30, 16, fans), MeshLocation::face, f);
    for (const float value : on.values) ASSERT_EQ(value, 0.1F);
  }
}

TEST(MeshWeights, ValuesOfCellsAreOfSecondOrderAmidAndOfFirstAtTheRim) {
  std::array<std::array<double, 2>, 3> within{};
  std::array<std::array<double, 2>, 3> whole{};
  for (std::size_t level = 0; level < 3; ++level) {
    const auto n = static_cast<std::uint32_t>(20U << level);
    const Resampled on = drawn(mixed_square(n, 0.2), MeshLocation::face, wave);
    within[level] = errors(on, wave, amid);
    whole[level] = errors(on, wave, everywhere);
  }
  for (std::size_t level = 0; level < 2; ++level) {
    EXPECT_GT(within[level][0] / within[level + 1][0], 3.2);  // 4: second order
    EXPECT_GT(within[level][1] / within[level + 1][1], 3.6);
    EXPECT_GT(whole[level][0] / whole[level + 1][0], 1.5);  // 2: first order
  }
}

TEST(MeshWeights, ValuesOfNodesAreOfSecondOrderEverywhere) {
  std::array<std::array<double, 2>, 3> found{};
  for (std::size_t level = 0; level < 3; ++level) {
    const auto n = static_cast<std::uint32_t>(20U << level);
    found[level] = errors(drawn(mixed_square(n, 0.2), MeshLocation::node, wave), wave, everywhere);
  }
  for (std::size_t level = 0; level < 2; ++level) {
    EXPECT_GT(found[level][0] / found[level + 1][0], 3.2);
    EXPECT_GT(found[level][1] / found[level + 1][1], 3.6);
  }
}

TEST(MeshWeights, TheGlobeHasNoSeamAndNoSpotsAtThePoles) {
  const auto f = [](double x, double y) {
    const double degree = std::numbers::pi / 180;
    return std::cos(y * degree) * std::cos(x * degree) + std::sin(y * degree);
  };
  for (const bool fans : {false, true}) {
    for (const auto location : {MeshLocation::node, MeshLocation::face}) {
      const Resampled on = drawn(globe(120, 60, fans), location, f);
      // A polygon of 3 degrees around a pole is larger than the other cells.
      EXPECT_LT(errors(on, f, everywhere)[0], fans ? 0.004 : 0.006);
    }
  }
}

TEST(MeshWeights, ValuesStayWithinTheRangeOfTheCells) {
  // So distorted that some nodes lie outside of the centroids around them.
  const Function step = [](double x, double y) { return std::sin(40 * x) < 0.8 * y ? 0.0 : 1.0; };
  const Resampled on = drawn(mixed_square(30, 0.45), MeshLocation::face, step);
  const auto [low, high] = std::minmax_element(on.values.begin(), on.values.end());
  EXPECT_EQ(*low, 0.0F);
  EXPECT_EQ(*high, 1.0F);
}

TEST(MeshWeights, MissingValuesMaskTheirCellsOnly) {
  const float missing = std::numeric_limits<float>::quiet_NaN();
  for (const auto location : {MeshLocation::face, MeshLocation::node}) {
    Resampled on = located(mixed_square(20, 0.2));
    const bool at_cells = location == MeshLocation::face;
    std::vector<float> values(at_cells ? on.mesh.cells() : on.mesh.nodes(), 1.0F);
    const std::uint32_t chosen = at_cells ? 200 : 100;
    values[chosen] = missing;
    draw(on, location, values);
    std::size_t masked = 0;
    for (std::size_t n = 0; n < on.values.size(); ++n) {
      const std::uint32_t cell = on.cells.cells[n];
      const auto* first = on.mesh.corners.data() + on.mesh.first[cell];
      const auto* last = on.mesh.corners.data() + on.mesh.first[cell + 1];
      const bool expected = at_cells ? cell == chosen : std::find(first, last, chosen) != last;
      ASSERT_EQ(std::isnan(on.values[n]), expected);
      masked += expected ? 1 : 0;
      if (!expected) {
        ASSERT_EQ(on.values[n], 1.0F);
      }
    }
    EXPECT_GT(masked, 0U);
  }
}

TEST(MeshWeights, AHoleIsMasked) {
  Mesh whole = mixed_square(30, 0);
  Mesh mesh;
  mesh.x = whole.x;
  mesh.y = whole.y;
  for (std::size_t c = 0; c < whole.cells(); ++c) {
    const auto [x, y] = center_of(whole, c);
    if (std::hypot(x - 0.5, y - 0.5) < 0.2) continue;
    add_polygon(
        mesh, {whole.corners.begin() + whole.first[c], whole.corners.begin() + whole.first[c + 1]});
  }
  const Resampled on =
      drawn(std::move(mesh), MeshLocation::node, [](double x, double) { return x; });
  for (std::size_t n = 0; n < on.values.size(); ++n) {
    const auto [x, y] = on.place(n);
    const double from_middle = std::hypot(x - 0.5, y - 0.5);
    if (from_middle < 0.14) {
      EXPECT_TRUE(std::isnan(on.values[n]));
    }
    if (from_middle > 0.27) {
      EXPECT_NEAR(on.values[n], x, 1e-6);
    }
  }
}

TEST(MeshAccuracy, TheErrorOfTheWaveFollowsTheLengthOfTheWave) {
  Resampled on = located(mixed_square(60, 0.1));
  for (const auto location : {MeshLocation::face, MeshLocation::node}) {
    MeshWeights weights(on.mesh, on.lattice, on.cells.cells, location);
    const double error = error_of_wave(on.mesh, on.lattice, weights, location);
    EXPECT_GT(error, 0.005);
    EXPECT_LT(error, 0.12);
  }
}

TEST(MeshCorners, EqualCornersAreOneNodeWhateverTheTurn) {
  // Two quadrilaterals at the date line and one triangle at the pole, padded.
  const double missing = std::numeric_limits<double>::quiet_NaN();
  const auto mesh =
      mesh_of_corners({178, 180, 180, 178, -180, -178, 182, 180, 178, 180, 30, missing},
                      {50, 50, 60, 60, 50, 50, 60, 60, 60, 60, 90, missing}, 4, 1e-7, "bounds");
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->cells(), 3U);
  EXPECT_EQ(mesh->nodes(), 7U);
  EXPECT_EQ(mesh->first, (std::vector<std::uint32_t>{0, 4, 8, 11}));
}

// Two quadrilaterals that share an edge, of which the second is displaced by a step of float32 at
// its longitude; on both sides of the edges of bins, and of the circle.
TEST(MeshCorners, CornersWithinTheToleranceAreOneNodeAtEveryLongitude) {
  for (std::size_t n = 0; n <= 720; ++n) {
    const auto x = static_cast<float>(0.4999 * static_cast<double>(n) + 0.05);
    const auto y = static_cast<float>(0.237 * static_cast<double>(n) - 85);
    const double left = x;
    const double right = std::nextafter(x, n % 2 == 0 ? 400.0F : -400.0F);
    const double low = y;
    const double again = std::nextafter(y, n % 3 == 0 ? 90.0F : -90.0F);
    const auto mesh =
        mesh_of_corners({left - 1, left, left, left - 1, right, left + 1, left + 1, right},
                        {low, low, low + 2, low + 2, again, low, low + 2, again + 2}, 4, 4e-5, "b");
    ASSERT_TRUE(mesh);
    const auto& c = mesh->corners;
    EXPECT_EQ((std::array{c[1], c[2]}), (std::array{c[4], c[7]})) << left << ' ' << low;
    EXPECT_EQ(std::set<std::uint32_t>(c.begin(), c.end()).size(), 6U);
  }
  const double below = std::nextafter(360.0F, 0.0F);
  const auto mesh = mesh_of_corners({50, 60, 60, 50, 359, below, below, 359, 0, 1, 1, 0},
                                    {10, 10, 20, 20, 30, 30, 40, 40, 30, 30, 40, 40}, 4, 4e-5, "b");
  ASSERT_TRUE(mesh);
  for (const auto& [a, b] : {std::pair(5, 8), {6, 11}}) {
    const std::uint32_t node = mesh->corners.at(static_cast<std::size_t>(a));
    EXPECT_EQ(mesh->corners.at(static_cast<std::size_t>(b)), node);
    EXPECT_NEAR(std::remainder(mesh->x[node], 360), 0, 4e-5);
    EXPECT_EQ(mesh->y[node], a == 5 ? 30 : 40);
  }
}

}  // namespace
}  // namespace windsplat::data::cf
