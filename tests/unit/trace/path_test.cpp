// Paths along flows whose solution is known.
#include "server/trace/path.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <vector>

namespace windsplat::trace {
namespace {

using glm::dvec3;
using Field = std::function<dvec3(const dvec3&)>;

constexpr double pi = std::numbers::pi;

// A rectilinear lattice with a field given by world position.
struct Block {
  std::array<std::vector<double>, 3> positions, spacing;
  std::array<std::vector<float>, 3> values;
  std::vector<std::array<float, 3>> places;

  Block(const std::array<std::vector<double>, 3>& at, const Field& field) : positions(at) {
    for (int a = 0; a < 3; ++a) {
      const auto& p = positions[a];
      for (std::size_t i = 0; i < p.size(); ++i) {
        const std::size_t low = i > 0 ? i - 1 : 0;
        const std::size_t high = std::min(i + 1, p.size() - 1);
        spacing[a].push_back(high > low ? (p[high] - p[low]) / static_cast<double>(high - low)
                                        : 1.0);
      }
    }
    for (const double z : positions[2]) {
      for (const double y : positions[1]) {
        for (const double x : positions[0]) {
          const dvec3 v = field({x, y, z});
          for (int c = 0; c < 3; ++c) values[c].push_back(static_cast<float>(v[c]));
        }
      }
    }
  }
  [[nodiscard]] Flow flow() const {
    Flow flow;
    for (int a = 0; a < 3; ++a) {
      flow.dims[a] = static_cast<int>(positions[a].size());
      flow.components[a] = values[a].data();
      flow.positions[a] = positions[a];
      flow.spacing[a] = spacing[a];
    }
    if (!places.empty()) flow.places = places.data();
    return flow;
  }
  [[nodiscard]] std::size_t number(int x, int y, int z) const {
    return static_cast<std::size_t>(x) +
           positions[0].size() *
               (static_cast<std::size_t>(y) + positions[1].size() * static_cast<std::size_t>(z));
  }
};

std::vector<double> even(int count, double from, double to) {
  std::vector<double> out;
  for (int i = 0; i < count; ++i) out.push_back(from + (to - from) * i / (count - 1));
  return out;
}

// The index of a world position on even axes.
dvec3 index_on(const Block& block, const dvec3& world) {
  dvec3 out(0);
  for (int a = 0; a < 3; ++a) {
    const auto& p = block.positions[a];
    if (p.size() > 1) out[a] = (world[a] - p[0]) / (p[1] - p[0]);
  }
  return out;
}

// A rotation about the middle, in cells one long: the interpolated field is exact.
Block rotation() {
  const auto x = even(33, -16, 16);
  return {{x, x, {0.0, 1.0}}, [](const dvec3& p) { return dvec3(-p.y, p.x, 0); }};
}

// The distance from its start after one turn, in cells, and the number of evaluations.
struct Turn {
  double miss = 0;
  int evaluations = 0;
};
Turn turn_at(double tolerance) {
  const Block block = rotation();
  Path path;
  const dvec3 start(26, 16, 0);
  follow(block.flow(), start, 2 * pi * 10, false, {tolerance, 100000}, path);
  EXPECT_EQ(path.end, End::length);
  return {glm::length(path.at(path.length).index - start), path.evaluations};
}

TEST(Path, ARotationReturnsToItsStart) {
  EXPECT_LT(turn_at(1e-3).miss, 0.02);
  EXPECT_LT(turn_at(1e-9).miss, 1e-6);
}

// Without control of the error a step is a cell long. x' = x, y' = -y is linear, and interpolated
// exactly by cells of any width: the miss from x0 e^t, y0 e^-t.
double saddle_at(int cells) {
  const auto x = even(cells + 1, -2, 2);
  const Block block({x, x, {0.0, 1.0}}, [](const dvec3& p) { return dvec3(p.x, -p.y, 0); });
  Path path;
  const dvec3 start(0.25, 1.5, 0);
  follow(block.flow(), index_on(block, start), 2, false, {1, 100000}, path);
  EXPECT_EQ(path.end, End::length);
  const Place end = path.at(path.length);
  const dvec3 at = block.flow().place(end.index);
  return std::hypot(at.x - start.x * std::exp(end.time), at.y - start.y * std::exp(-end.time));
}

// From 1/8 to 1/16 of a world unit, terms of higher orders make it fall faster than asymptotically.
TEST(Path, TheErrorFallsAtLeastWithTheFifthPowerOfTheStep) {
  EXPECT_GT(std::log2(saddle_at(32) / saddle_at(64)), 4.8);
  EXPECT_LT(saddle_at(64), 1e-9);
}

TEST(Path, TimeIsLengthOverSpeed) {
  const Block block = rotation();
  for (const bool upstream : {false, true}) {
    Path path;
    follow(block.flow(), {26, 16, 0}, pi * 10, upstream, {1e-9, 10000}, path);
    // Half a turn at the angular speed 1.
    EXPECT_NEAR(path.at(path.length).time, upstream ? -pi : pi, 1e-6);
    EXPECT_NEAR(path.at(path.length / 2).index.y, upstream ? 6 : 26, 1e-5);
    // Between the ends of steps too.
    for (double s = 0; s < path.length; s += 0.37) {
      const dvec3 at = path.at(s).index - dvec3(16, 16, 0);
      EXPECT_NEAR(glm::length(at), 10, 1e-5);
      EXPECT_NEAR(std::abs(path.at(s).time), s / 10, 1e-6);
    }
  }
}

// The way is lost in the rounding of the index.
TEST(Path, OfAnyLengthIsNoStagnation) {
  const Block block = rotation();
  for (const double length : {1e-10, 1e-20, 1e-30, 1e-37}) {
    Path path;
    follow(block.flow(), {26, 16, 0}, length, false, {}, path);
    EXPECT_EQ(path.end, End::length) << length;
    EXPECT_NEAR(path.length, length, 1e-11 * length);
  }
}

// Twenty turns on a circle of 20 cells across.
TEST(Path, OfSmallToleranceIsNotCutShort) {
  const Block block = rotation();
  Path path;
  Limits limits;
  limits.tolerance = 1e-9;
  follow(block.flow(), {26, 16, 0}, 40 * pi * 10, false, limits, path);
  EXPECT_GT(path.steps.size(), 1000U);
  EXPECT_EQ(path.end, End::length);
}

// x' = x, y' = -y from (x0, y0): x0 e^t, y0 e^-t, on axes whose cells differ.
TEST(Path, ASaddleOnUnevenAxesGrowsByTheExponential) {
  std::vector<double> x, y;
  for (int i = 0; i < 40; ++i) x.push_back(0.05 * i + 0.004 * i * i);
  for (int i = 0; i < 25; ++i) y.push_back(0.02 * i + 0.003 * i * i - 0.3);
  const Block block({x, y, {0.0, 1.0}}, [](const dvec3& p) { return dvec3(p.x, -p.y, 0); });
  const Flow flow = block.flow();
  Path path;
  follow(flow, {4, 22, 0}, 3, false, {1e-8, 10000}, path);
  ASSERT_EQ(path.end, End::length);
  const dvec3 from = flow.place({4, 22, 0});
  EXPECT_NEAR(from.x, x[4], 1e-12);
  for (double s = 0.1; s <= 3; s += 0.4) {
    const Place at = path.at(s);
    const dvec3 place = flow.place(at.index);
    EXPECT_NEAR(place.x, from.x * std::exp(at.time), 1e-5 * place.x);
    EXPECT_NEAR(place.y, from.y * std::exp(-at.time), 1e-5);
  }
}

// The flow of Arnold, Beltrami and Childress, followed in small steps of the classical method of
// order 4 in the function itself. What remains is the interpolation, of second order in the cell.
double abc_miss(int cells, const dvec3& start) {
  const Field abc = [](const dvec3& p) {
    const double a = std::sqrt(3.0), b = std::sqrt(2.0), c = 1;
    return dvec3(a * std::sin(p.z) + c * std::cos(p.y), b * std::sin(p.x) + a * std::cos(p.z),
                 c * std::sin(p.y) + b * std::cos(p.x));
  };
  const auto x = even(cells + 1, 0, 2 * pi);
  const Block block({x, x, x}, abc);
  const double length = 2;
  Path path;
  follow(block.flow(), index_on(block, start), length, false, {1e-9, 100000}, path);
  EXPECT_EQ(path.end, End::length);
  dvec3 p = start;
  const int steps = 2000;
  const double h = length / steps;
  const auto unit = [&](const dvec3& at) { return glm::normalize(abc(at)); };
  for (int n = 0; n < steps; ++n) {
    const dvec3 a = unit(p), b = unit(p + 0.5 * h * a), c = unit(p + 0.5 * h * b);
    p += h / 6 * (a + 2.0 * b + 2.0 * c + unit(p + h * c));
  }
  return glm::length(block.flow().place(path.at(path.length).index) - p);
}

TEST(Path, TheAbcFlowIsThatOfAnIndependentIntegration) {
  double coarse = 0;
  double fine = 0;
  for (const dvec3& start : {dvec3(3, 3.5, 2.5), dvec3(2, 3, 4), dvec3(3.6, 2.2, 3.1)}) {
    coarse += abc_miss(32, start) / 3;
    fine += abc_miss(64, start) / 3;
  }
  EXPECT_LT(fine, 3e-3);
  EXPECT_GT(coarse / fine, 3);
  EXPECT_LT(coarse / fine, 5.5);
}

// A globe of columns `step` degrees apart with the components east, north, up.
Block globe(double step, const Field& components) {
  std::vector<double> longitude, latitude;
  for (double d = 0; d < 360; d += step) longitude.push_back(d);
  for (double d = -80; d <= 80; d += step) latitude.push_back(d);
  Block block({longitude, latitude, {1.0, 1.1}}, components);
  for (const double r : block.positions[2]) {
    for (const double phi : latitude) {
      for (const double lambda : longitude) {
        const double a = lambda * pi / 180, b = phi * pi / 180;
        block.places.push_back({static_cast<float>(r * std::cos(b) * std::cos(a)),
                                static_cast<float>(r * std::cos(b) * std::sin(a)),
                                static_cast<float>(r * std::sin(b))});
      }
    }
  }
  return block;
}

TEST(Path, AWindFromTheWestFollowsItsParallelAroundTheGlobe) {
  const Block block = globe(2, [](const dvec3&) { return dvec3(7, 0, 0); });
  Flow flow = block.flow();
  flow.around = 180;
  Path path;
  const double turn = 2 * pi * std::cos(40 * pi / 180);
  follow(flow, {170, 60, 0}, turn, false, {1e-6, 100000}, path);
  ASSERT_EQ(path.end, End::length);
  const Place end = path.at(path.length);
  EXPECT_NEAR(end.index.y, 60, 1e-6);
  EXPECT_NEAR(end.index.x - 170, 180, 0.05);  // chords are 5e-5 shorter than arcs
  EXPECT_NEAR(glm::length(flow.place(end.index) - flow.place({170, 60, 0})), 0, 1e-3);
}

// A solid rotation about an axis in the plane of the equator follows a great circle through the
// pole of that axis's equator.
TEST(Path, ARotationOfTheGlobeFollowsAGreatCircle) {
  const dvec3 axis = glm::normalize(dvec3(1, 0.3, 1.2));
  const auto motion = [&](const dvec3& p) {
    const double a = p.x * pi / 180, b = p.y * pi / 180;
    const dvec3 at(std::cos(b) * std::cos(a), std::cos(b) * std::sin(a), std::sin(b));
    const dvec3 east(-std::sin(a), std::cos(a), 0);
    const dvec3 north = glm::cross(at, east);
    const dvec3 v = glm::cross(axis, at);
    return dvec3(glm::dot(v, east), glm::dot(v, north), 0);
  };
  const auto miss = [&](double step) {
    const Block block = globe(step, motion);
    Flow flow = block.flow();
    flow.around = static_cast<int>(360 / step);
    // The equator of the axis meets that of the earth where x + 0.3 y = 0.
    const double lambda = std::atan2(-1.0, 0.3) * 180 / pi + 360;
    Path path;
    follow(flow, {lambda / step, 80 / step, 0}, 1.0, false, {1e-8, 100000}, path);
    EXPECT_EQ(path.end, End::length);
    double most = 0;
    for (double s = 0; s <= 1; s += 0.05) {
      most = std::max(most, std::abs(glm::dot(axis, flow.place(path.at(s).index))));
    }
    return most;
  };
  const double fine = miss(2);
  EXPECT_LT(fine, 1e-3);
  EXPECT_GT(miss(4) / fine, 3);  // second order in the cell
}

TEST(Path, EndsAtTheBoundaryOfTheLattice) {
  const auto x = even(8, 0, 7);
  const Block block({x, x, x}, [](const dvec3&) { return dvec3(2, 0, 0); });
  Path path;
  follow(block.flow(), {3, 3, 3}, 100, false, {}, path);
  EXPECT_EQ(path.end, End::boundary);
  EXPECT_NEAR(path.length, 4.5, 1e-9);  // half a cell beyond the last sample
  follow(block.flow(), {3, 3, 3}, 100, true, {}, path);
  EXPECT_NEAR(path.length, 3.5, 1e-9);
}

TEST(Path, EndsAtTheFaceOfAMaskedCell) {
  const auto x = even(8, 0, 7);
  Block block({x, x, x}, [](const dvec3&) { return dvec3(2, 0, 0); });
  block.values[0][block.number(5, 3, 3)] = std::numeric_limits<float>::quiet_NaN();
  Path path;
  follow(block.flow(), {3, 3.2, 3}, 100, false, {}, path);
  EXPECT_EQ(path.end, End::masked);
  EXPECT_NEAR(path.length, 1.5, 1e-9);
  follow(block.flow(), {3, 3.6, 3}, 100, false, {}, path);  // passes beside it
  EXPECT_EQ(path.end, End::boundary);
  follow(block.flow(), {5, 3, 3}, 100, false, {}, path);  // begins in it
  EXPECT_EQ(path.end, End::masked);
  EXPECT_EQ(path.length, 0);
}

TEST(Path, EndsWhereTheFlowStagnates) {
  const auto x = even(9, -4, 4);
  const Block sink({x, x, x}, [](const dvec3& p) { return -p; });
  Path path;
  follow(sink.flow(), {7, 5, 4}, 100, false, {}, path);
  EXPECT_EQ(path.end, End::stagnation);
  EXPECT_NEAR(path.length, std::sqrt(10.0), 0.02);
  const Block still({x, x, x}, [](const dvec3&) { return dvec3(0); });
  follow(still.flow(), {4, 4, 4}, 1, false, {}, path);
  EXPECT_EQ(path.end, End::stagnation);
  EXPECT_EQ(path.length, 0);
}

TEST(Path, EndsAfterTheMostSteps) {
  const Block block = rotation();
  Path path;
  follow(block.flow(), {26, 16, 0}, 1e6, false, {1e-3, 50}, path);
  EXPECT_EQ(path.end, End::steps);
  EXPECT_GT(path.length, 10);
}

// The path depends on directions alone; times scale with the speed.
TEST(Path, VectorsOfAnyMagnitudeGiveTheSamePath) {
  const auto x = even(17, -8, 8);
  const auto path_of = [&](double factor) {
    const Block block({x, x, x}, [&](const dvec3& p) {
      return factor * dvec3(1 - 0.1 * p.y, 0.7 + 0.05 * p.x, 0.2);
    });
    Path path;
    follow(block.flow(), {4, 5, 6}, 5, false, {1e-6, 1000}, path);
    EXPECT_EQ(path.end, End::length);
    return path.at(path.length);
  };
  const Place one = path_of(1);
  for (const double factor : {1e-30, 1e30}) {
    const Place other = path_of(factor);
    EXPECT_NEAR(glm::length(other.index - one.index), 0, 1e-5);
    EXPECT_NEAR(other.time * factor / one.time, 1, 1e-5);
  }
}

// No value, however extreme, gives a place that is not a number or runs without end.
TEST(Path, ExtremeFieldsGiveFinitePlaces) {
  const auto x = even(6, 0, 5);
  unsigned state = 7;
  const auto draw = [&state] {
    state = state * 1664525U + 1013904223U;
    return static_cast<double>(state >> 8U) / 16777216.0 - 0.5;
  };
  Block block({x, x, x}, [&](const dvec3&) {
    const double size = std::pow(10.0, 76 * draw());
    return size * dvec3(draw(), draw(), draw());
  });
  for (int n = 0; n < 40; ++n) {
    const auto masked = static_cast<std::size_t>((draw() + 0.5) * 215);
    block.values[0][masked] = std::numeric_limits<float>::quiet_NaN();
  }
  for (int n = 0; n < 200; ++n) {
    Path path;
    follow(block.flow(), dvec3(draw() + 0.5, draw() + 0.5, draw() + 0.5) * 5.0, 20, n % 2 == 0, {},
           path);
    EXPECT_LE(path.evaluations, 7001);
    for (double part = 0; part <= 1; part += 0.1) {
      const dvec3 at = block.flow().place(path.at(part * path.length).index);
      EXPECT_TRUE(std::isfinite(at.x) && std::isfinite(at.y) && std::isfinite(at.z));
    }
  }
}

}  // namespace
}  // namespace windsplat::trace
