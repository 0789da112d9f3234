// Orders of convergence of the reference's quadrature and of every compositing rule for a cell.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/engine/reference/cell_rules.hpp"
#include "server/engine/reference/ray.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

namespace reference = engine::reference;
using reference::Cell;
using reference::CellLight;
using reference::Light;
using reference::Samples;
using reference::Surface;
using scene::Compositing;

// ---- a medium on [0, 1] with lines in it ----

constexpr double edge = 0.4371;  // discontinuity of the medium

struct Haze {
  bool stepped = false;
  [[nodiscard]] double rho(double z) const {
    if (z < 0 || z > 1) return 0;
    return 2.5 + 1.5 * std::sin(5 * z + 0.4) + (stepped && z > edge ? 3.0 : 0.0);
  }
  [[nodiscard]] std::array<double, 3> color(double z) const {
    return {0.5 + 0.4 * std::cos(4 * z), 0.2 + 0.6 * z, stepped && z > edge ? 0.1 : 0.9};
  }
  void begin(double, double) const {}
  void operator()(const double* depth, int count, Samples& out) const {
    for (int j = 0; j < count; ++j) {
      out.extinction[j] = rho(depth[j]);
      const auto c = color(depth[j]);
      for (int i = 0; i < 3; ++i) out.emission[i][j] = out.extinction[j] * c[i];
    }
  }
};

std::vector<Surface> some_lines() {
  return {{0.1234, 0.4, {1, 0.2, 0}}, {0.3777, 0.7, {0, 1, 0.3}}, {0.7071, 0.5, {0.2, 0.4, 1}}};
}

double distance(const Light& a, const Light& b) {
  double square = (a.alpha - b.alpha) * (a.alpha - b.alpha);
  for (int c = 0; c < 3; ++c) square += (a.rgb[c] - b.rgb[c]) * (a.rgb[c] - b.rgb[c]);
  return std::sqrt(square);
}

Light truth(const Haze& haze, const std::vector<Surface>& lines) {
  reference::RayCount count;
  Haze medium = haze;
  const std::vector<double> breaks =
      haze.stepped ? std::vector<double>{0, edge, 1} : std::vector<double>{0, 1};
  return reference::integrate_ray(reference::make_rules(), medium, breaks, lines, 1e-13, count);
}

// Least squares through (log x, log y).
double slope(const std::vector<double>& x, const std::vector<double>& y) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double u = std::log(x[i]);
    const double v = std::log(y[i]);
    sx += u;
    sy += v;
    sxx += u * u;
    sxy += u * v;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

// ---- the rule of the reference ----

double uniform_error(int nodes, int pieces) {
  const reference::Rules rules = reference::make_rules(nodes);
  const Haze haze;
  reference::RayCount count;
  Light light;
  for (int i = 0; i < pieces; ++i) {
    reference::integrate_piece(rules, haze, static_cast<double>(i) / pieces, (i + 1.0) / pieces, 0,
                               1e300, light, count);
  }
  EXPECT_EQ(count.pieces, pieces);
  return distance(light, truth(haze, {}));
}

TEST(ReferenceRule, ConvergesWhenItsNodesAreDoubled) {
  for (const int nodes : {2, 3}) {
    std::vector<double> width;
    std::vector<double> error;
    for (const int pieces : {16, 32, 64, 128}) {
      width.push_back(1.0 / pieces);
      error.push_back(uniform_error(nodes, pieces));
    }
    EXPECT_NEAR(slope(width, error), 2 * nodes, 0.3) << nodes;
  }
  EXPECT_LT(uniform_error(8, 4), 1e-13);
}

TEST(ReferenceRule, ErrorStaysBelowItsTolerance) {
  const Haze haze;
  const Light exact = truth(haze, some_lines());
  std::int64_t before = 0;
  for (const double tolerance : {1e-3, 1e-5, 1e-7, 1e-9, 1e-11}) {
    for (const int nodes : {4, 6, 8}) {
      reference::RayCount count;
      Haze medium;
      const Light light = reference::integrate_ray(reference::make_rules(nodes), medium, {0, 1},
                                                   some_lines(), tolerance, count);
      EXPECT_LT(distance(light, exact), tolerance) << nodes;
      if (nodes == 4) {
        EXPECT_GT(count.pieces, before);
        before = count.pieces;
      }
    }
  }
}

// ---- orders of the rules of cells ----

enum class Rule {
  euler,          // 1 - rho L for exp(-rho L), the line at its position
  snapped,        // simple: the line at the back of its cell
  corrected,      // C*D with the chord
  exact,          // the homogeneous cell
  split_at_lines  // midpoint cells, divided at each line
};

CellLight haze_cell(const Haze& haze, Compositing by, double from, double to, const Surface* line) {
  Cell cell;
  const double middle = 0.5 * (from + to);
  cell.tau = haze.rho(middle) * (to - from);
  cell.medium = haze.color(middle);
  if (line != nullptr) {
    cell.x = (line->depth - from) / (to - from);
    cell.opacity = line->opacity;
    cell.line = line->color;
  }
  return reference::cell_light(by, cell);
}

// One cell, entirely within the medium; at most one line in it.
void add_cell(const Haze& haze, Rule rule, double from, double to, const Surface* line,
              Light& light) {
  switch (rule) {
    case Rule::euler:
      composite(haze_cell(haze, Compositing::cd_euler, from, to, line), light);
      return;
    case Rule::snapped:
      composite(haze_cell(haze, Compositing::simple, from, to, line), light);
      return;
    case Rule::corrected:
      composite(haze_cell(haze, Compositing::cd, from, to, line), light);
      return;
    case Rule::exact:
      composite(haze_cell(haze, Compositing::analytic, from, to, line), light);
      return;
    case Rule::split_at_lines:
      if (line != nullptr) {
        composite(haze_cell(haze, Compositing::analytic, from, line->depth, nullptr), light);
        reference::cross_surface(*line, light);
        from = line->depth;
      }
      composite(haze_cell(haze, Compositing::analytic, from, to, nullptr), light);
  }
}

// Cells of width 1 / n with borders at (i + phase) / n, clipped to the medium (and optionally at
// its edge).
Light by_cells(const Haze& haze, const std::vector<Surface>& lines, Rule rule, int n, double phase,
               bool split_at_edge) {
  std::vector<double> borders{0};
  for (int i = 0; i < n; ++i) borders.push_back((i + phase) / n);
  if (split_at_edge) {
    borders.insert(std::lower_bound(borders.begin(), borders.end(), edge), edge);
  }
  borders.push_back(1);
  Light light;
  for (std::size_t i = 0; i + 1 < borders.size(); ++i) {
    const double from = borders[i];
    const double to = borders[i + 1];
    if (!(to > from)) continue;
    const Surface* inside = nullptr;
    for (const Surface& line : lines) {
      if (line.depth >= from && line.depth < to) inside = &line;
    }
    add_cell(haze, rule, from, to, inside, light);
  }
  return light;
}

// Slope of the phase-averaged RMS error over the cell width.
double order(const Haze& haze, const std::vector<Surface>& lines, Rule rule, bool split_at_edge) {
  const Light exact = truth(haze, lines);
  std::mt19937 random(17);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<double> width;
  std::vector<double> error;
  for (int n = 64; n <= 1024; n *= 2) {
    constexpr int phases = 400;
    double square = 0;
    for (int i = 0; i < phases; ++i) {
      const double d = distance(by_cells(haze, lines, rule, n, unit(random), split_at_edge), exact);
      square += d * d / phases;
    }
    width.push_back(1.0 / n);
    error.push_back(std::sqrt(square));
  }
  return slope(width, error);
}

TEST(CellOrder, EulerAndLinesAtTheBackOfTheirCellAreFirstOrder) {
  EXPECT_NEAR(order({}, some_lines(), Rule::euler, false), 1, 0.3);
  EXPECT_NEAR(order({}, some_lines(), Rule::snapped, false), 1, 0.3);
}

TEST(CellOrder, CorrectedAndExactCellsAreSecondOrder) {
  EXPECT_NEAR(order({}, some_lines(), Rule::corrected, false), 2, 0.3);
  EXPECT_NEAR(order({}, some_lines(), Rule::exact, false), 2, 0.3);
}

TEST(CellOrder, MidpointCellsSplitAtLinesAreSecondOrder) {
  EXPECT_NEAR(order({}, some_lines(), Rule::split_at_lines, false), 2, 0.3);
}

TEST(CellOrder, DiscontinuityCostsAnOrderUnlessCellsAreSplitThere) {
  const Haze stepped{true};
  for (const Rule rule : {Rule::exact, Rule::corrected, Rule::split_at_lines}) {
    EXPECT_NEAR(order(stepped, some_lines(), rule, false), 1, 0.3);
    EXPECT_NEAR(order(stepped, some_lines(), rule, true), 2, 0.3);
  }
}

// ---- bounds implied by the formulas ----

TEST(CellRules, CorrectedDeviatesByAtMostAnEighthOfTauSquared) {
  for (const double tau : {1e-4, 0.01, 0.3, 1.0, 3.0}) {
    for (int i = 0; i <= 20; ++i) {
      Cell cell{tau, i / 20.0, 0.8, {1, 0, 0.5}, {0, 1, 0.25}};
      const CellLight exact = reference::cell_light(Compositing::analytic, cell);
      const CellLight chord = reference::cell_light(Compositing::cd, cell);
      EXPECT_DOUBLE_EQ(exact.alpha, chord.alpha);
      for (int c = 0; c < 3; ++c) {
        const double bound = tau * tau / 8 * 0.8 * std::abs(cell.line[c] - cell.medium[c]);
        EXPECT_LE(std::abs(exact.rgb[c] - chord.rgb[c]), bound + 1e-15);
      }
    }
  }
}

TEST(CellRules, NaiveLosesAQuarterOfTheLightOfTheMediumAroundALine) {
  for (const double tau : {0.1, 2.0, 50.0}) {
    const double absorbed = -std::expm1(-tau);
    const Cell cell{tau, 0.5, 0, {1, 0.5, 0}, {0, 0, 0}};
    const CellLight naive = reference::cell_light(Compositing::cd_naive, cell);
    EXPECT_NEAR(naive.rgb[0], absorbed * (1 - 0.25 * absorbed), 1e-15);
  }
}

// ---- the cell of the engine equals this cell ----

scene::Scene one_kernel(double rho, double slope_y) {
  scene::Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, {2, 2, 2});
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 5, 41, 3, false, 3.0 / 40);
  scene.vector = plain_lines(make_volume(scene.lattice, 3,
                                         [=](int c, double, double, double) {
                                           if (c == 2) return 0.0F;
                                           return c == 0 ? 10.0F : static_cast<float>(slope_y);
                                         }),
                             {0.2F, 0.5F, 0.8F});
  scene.vector->magnitude_range = {0, 10};
  scene.vector->length = 3;
  scene.vector->r1 = 2;
  scene.vector->r2 = 3;
  scene.vector->opacity = 0.75;
  scene.scalars.push_back(
      medium(make_volume(scene.lattice, 1,
                         [=](int, double, double, double) { return static_cast<float>(rho); }),
             {0.9F, 0.1F, 0.3F}));
  return scene;
}

void expect_cells(Compositing compositing, double rho) {
  for (const double slope_y : {0.0, 4.0, -9.0}) {
    scene::Scene scene = one_kernel(rho, slope_y);
    scene.compositing = compositing;
    const engine::Image image = render(scene).image;
    for (int x = 8; x <= 32; ++x) {
      const double world = (x - 20) / 20.0;
      Cell cell;
      cell.tau = rho * footprint(std::abs(world) / 2) * 2 / 1.4476982547;
      cell.x = std::clamp(0.5 + world * slope_y / 10 / 2, 0.0, 1.0);
      cell.opacity = 0.75;
      cell.medium = {0.9, 0.1, 0.3};
      cell.line = {0.2, 0.5, 0.8};
      const CellLight light = reference::cell_light(compositing, cell);
      EXPECT_NEAR(pixel(image, x, 1)[3], light.alpha, 1e-5) << x;
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(pixel(image, x, 1)[c], light.rgb[c], 1e-4) << x << " " << rho;
      }
    }
  }
}

TEST(EngineCell, EveryCompositingEqualsItsFormula) {
  for (const Compositing by :
       {Compositing::simple, Compositing::cd_naive, Compositing::cd, Compositing::analytic}) {
    for (const double rho : {0.01, 0.7, 3.0, 60.0}) expect_cells(by, rho);
  }
  for (const double rho : {0.01, 0.7, 3.0}) expect_cells(Compositing::cd_euler, rho);
}

}  // namespace
}  // namespace windsplat::test
