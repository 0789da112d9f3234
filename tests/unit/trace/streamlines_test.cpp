// Lines through seeds in flows whose solution is known.
#include "server/trace/streamlines.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <vector>

namespace windsplat::trace {
namespace {

using glm::dvec3;
using WindAt = std::function<dvec3(const dvec3&)>;

constexpr double half_turn = std::numbers::pi;

// An evenly spaced lattice with samples at integer world positions from `low`, times a width.
struct SeedField {
  std::array<std::vector<double>, 3> positions, spacing;
  std::array<std::vector<float>, 3> values;
  std::vector<std::array<float, 3>> places;

  SeedField(const std::array<int, 3>& dims, const dvec3& low, double width, const WindAt& wind) {
    for (int a = 0; a < 3; ++a) {
      for (int i = 0; i < dims[a]; ++i) positions[a].push_back(low[a] + width * i);
      spacing[a].assign(static_cast<std::size_t>(dims[a]), width);
    }
    for (const double z : positions[2]) {
      for (const double y : positions[1]) {
        for (const double x : positions[0]) {
          const dvec3 v = wind({x, y, z});
          for (int c = 0; c < 3; ++c) values[c].push_back(static_cast<float>(v[c]));
        }
      }
    }
  }
  [[nodiscard]] Streamlines lines() const {
    Streamlines of;
    for (int a = 0; a < 3; ++a) {
      of.flow.dims[a] = static_cast<int>(positions[a].size());
      of.flow.components[a] = values[a].data();
      of.flow.positions[a] = positions[a];
      of.flow.spacing[a] = spacing[a];
    }
    if (!places.empty()) of.flow.places = places.data();
    of.limits = {1e-8, 100000};
    of.pieces_max = 4096;
    of.departure = 1e-3;
    of.longest = HUGE_VAL;
    of.full_magnitude = 1;
    of.color = [](const dvec3&, const Motion& motion) { return motion.magnitude; };
    return of;
  }
};

// The vertices of each chain.
std::vector<std::vector<dvec3>> chains_of(const Segments& from) {
  std::vector<std::vector<dvec3>> out;
  bool open = false;
  for (std::size_t v = 0; v < from.vertices(); ++v) {
    const auto& p = from.places[v];
    const bool begins = from.magnitudes[v] > 0;
    if (!open && begins) out.emplace_back();
    if (open || begins) out.back().emplace_back(p[0], p[1], p[2]);
    open = begins;
  }
  return out;
}

double length_of(const std::vector<dvec3>& chain) {
  double sum = 0;
  for (std::size_t n = 1; n < chain.size(); ++n) sum += glm::length(chain[n] - chain[n - 1]);
  return sum;
}

SeedField solid_rotation() {
  return {{33, 33, 2}, {-16, -16, 0}, 1, [](const dvec3& p) { return dvec3(-p.y, p.x, 0); }};
}

TEST(Streamlines, CirclesOfASolidRotationClose) {
  const SeedField field = solid_rotation();
  Streamlines of = field.lines();
  of.seeds = {{26, 16, 0}, {16, 11, 1}};
  of.length = half_turn * 10;
  const Segments made = make_streamlines(of);
  const auto chains = chains_of(made);
  ASSERT_EQ(chains.size(), 2U);
  EXPECT_LT(glm::length(chains[0].front() - chains[0].back()), 1e-4);
  for (const dvec3& at : chains[0]) EXPECT_NEAR(std::hypot(at.x, at.y), 10, 1e-4);
  // The chord of a segment departs from its arc by r (1 - cos(half its angle)).
  for (std::size_t n = 1; n < chains[0].size(); ++n) {
    EXPECT_LE(10 - glm::length(0.5 * (chains[0][n] + chains[0][n - 1])), 1.1e-3);
  }
  // The second circle, half as large, is passed twice.
  for (const dvec3& at : chains[1]) EXPECT_NEAR(std::hypot(at.x, at.y), 5, 1e-4);
  EXPECT_EQ(made.tally.lines, 2);
  EXPECT_EQ(made.tally.ends[static_cast<std::size_t>(End::length)], 4);
}

TEST(Streamlines, AHelixRisesInProportionToItsTurn) {
  const SeedField field({33, 33, 33}, {-16, -16, -16}, 1,
                        [](const dvec3& p) { return dvec3(-p.y, p.x, 3); });
  Streamlines of = field.lines();
  of.seeds = {{22, 16, 16}};
  of.limits.duration_max = 2;  // three units of height a unit of time
  of.length = 1000;
  const auto chains = chains_of(make_streamlines(of));
  ASSERT_EQ(chains.size(), 1U);
  EXPECT_NEAR(chains[0].front().z, -6, 1e-3);
  EXPECT_NEAR(chains[0].back().z, 6, 1e-3);
  for (const dvec3& at : chains[0]) {
    EXPECT_NEAR(at.x, 6 * std::cos(at.z / 3), 1e-4);
    EXPECT_NEAR(at.y, 6 * std::sin(at.z / 3), 1e-4);
  }
}

TEST(Streamlines, ASaddleHasHyperbolas) {
  const SeedField field({65, 65, 1}, {-4, -4, 0}, 0.125,
                        [](const dvec3& p) { return dvec3(p.x, -p.y, 0); });
  Streamlines of = field.lines();
  of.seeds = {{40, 40, 0}, {24, 48, 0}};  // (1, 1) and (-1, 2)
  of.length = 100;
  const Segments made = make_streamlines(of);
  const auto chains = chains_of(made);
  ASSERT_EQ(chains.size(), 2U);
  for (const std::size_t n : {0U, 1U}) {
    for (const dvec3& at : chains[n]) {
      // Beyond the outermost samples the wind is constant.
      if (std::max(std::abs(at.x), at.y) > 4) continue;
      EXPECT_NEAR(at.x * at.y, n == 0 ? 1 : -2, 1e-5);
    }
  }
  // They leave the lattice, half a cell beyond its samples.
  EXPECT_NEAR(chains[0].front().y, 4.0625, 1e-6);
  EXPECT_NEAR(chains[0].back().x, 4.0625, 1e-6);
  EXPECT_EQ(made.tally.ends[static_cast<std::size_t>(End::boundary)], 4);
}

TEST(Streamlines, MaskedCellsAndStagnationEndThem) {
  SeedField field({33, 33, 1}, {-16, -16, 0}, 1,
                  [](const dvec3& p) { return dvec3(4 - p.x, 0, 0); });
  Streamlines of = field.lines();
  of.seeds = {{4, 3, 0}};
  of.length = 100;
  const auto still = chains_of(make_streamlines(of));
  ASSERT_EQ(still.size(), 1U);
  EXPECT_NEAR(still[0].back().x, 4, 1e-2);
  field.values[0][33 * 3 + 10] = std::numeric_limits<float>::quiet_NaN();
  const Segments made = make_streamlines(of);
  const auto masked = chains_of(made);
  ASSERT_EQ(masked.size(), 1U);
  EXPECT_NEAR(masked[0].back().x, -16 + 9.5, 1e-6);
  EXPECT_EQ(made.tally.ends[static_cast<std::size_t>(End::masked)], 1);
  of.seeds = {{10, 3, 0}};  // in the masked cell
  EXPECT_TRUE(chains_of(make_streamlines(of)).empty());
}

// A globe of radius 1 with columns two degrees apart and a wind from the west.
SeedField windy_globe() {
  SeedField globe({180, 81, 1}, {0, 0, 0}, 1, [](const dvec3&) { return dvec3(3, 0, 0); });
  for (int j = 0; j < 81; ++j) {
    for (int i = 0; i < 180; ++i) {
      const double a = 2 * i * half_turn / 180;
      const double b = (2 * j - 80) * half_turn / 180;
      globe.places.push_back({static_cast<float>(std::cos(b) * std::cos(a)),
                              static_cast<float>(std::cos(b) * std::sin(a)),
                              static_cast<float>(std::sin(b))});
    }
  }
  return globe;
}

TEST(Streamlines, AZonalWindFollowsTheGreatCircleOfTheEquator) {
  const SeedField globe = windy_globe();
  Streamlines of = globe.lines();
  of.flow.around = 180;
  of.seeds = {{170, 40, 0}};
  of.length = half_turn;
  const auto chains = chains_of(make_streamlines(of));
  ASSERT_EQ(chains.size(), 1U);  // it passes the seam in one piece
  for (const dvec3& at : chains[0]) {
    EXPECT_NEAR(at.z, 0, 1e-6);
    EXPECT_NEAR(glm::length(at), 1, 2e-4);
  }
  // Chords of two degrees are 5e-5 shorter than their arcs.
  EXPECT_LT(glm::length(chains[0].front() - chains[0].back()), 1e-3);
}

TEST(Streamlines, AFlatMapThatClosesIsLeftOnOneSideAndEnteredOnTheOther) {
  const SeedField map({36, 9, 1}, {0, 0, 0}, 10, [](const dvec3&) { return dvec3(2, 0.5, 0); });
  Streamlines of = map.lines();
  of.flow.around = 36;
  of.seeds = {{30, 4, 0}};
  of.length = 100;
  const auto chains = chains_of(make_streamlines(of));
  ASSERT_EQ(chains.size(), 2U);
  EXPECT_NEAR(chains[0].back().x, 355, 1e-4);
  EXPECT_NEAR(chains[1].front().x, -5, 1e-4);
  EXPECT_NEAR(chains[0].back().y, chains[1].front().y, 1e-4);
  EXPECT_NEAR(length_of(chains[0]) + length_of(chains[1]), 200, 1e-3);
  EXPECT_NEAR(chains[1].back().x, 300 + 100 * 2 / std::hypot(2, 0.5) - 360, 1e-3);
  of.flow.around = 0;  // without a circle it ends there
  const auto one = chains_of(make_streamlines(of));
  ASSERT_EQ(one.size(), 1U);
  EXPECT_NEAR(one[0].back().x, 355, 1e-4);
}

// Around six columns 200 times on each side: what is drawn fits into the memory foreseen.
TEST(Streamlines, ALineThatPassesTheSeamOftenEndsAfterSomeTurns) {
  const SeedField map({6, 3, 1}, {0, 0, 0}, 10, [](const dvec3&) { return dvec3(2, 0, 0); });
  Streamlines of = map.lines();
  of.flow.around = 6;
  of.seeds = {{3, 1, 0}};
  of.length = 12000;
  of.pieces_max = 4;
  const Segments made = make_streamlines(of);
  EXPECT_EQ(chains_of(made).size(), 64U);
  EXPECT_LE(made.vertices(), static_cast<std::size_t>(room_of(of, 1).vertices));
  float low = 1;
  float high = -1;
  for (std::size_t v = 0; v < made.vertices(); ++v) {
    if (!(made.magnitudes[v] > 0)) continue;
    low = std::min(low, made.q[v]);
    high = std::max(high, made.q[v]);
  }
  EXPECT_FLOAT_EQ(low, -0.5F);
  EXPECT_NEAR(high, 0.5 - 1.0 / 64, 1e-3);
}

// Frames of a uniform wind along x and y.
struct WindFrames {
  std::vector<SeedField> fields;
  std::vector<Frame> frames;
  WindFrames(double from, double to, int count, const std::function<dvec3(double)>& wind) {
    for (int n = 0; n < count; ++n) {
      const double t = from + (to - from) * n / (count - 1);
      fields.emplace_back(std::array{17, 17, 1}, dvec3(-8, -8, 0), 1.0,
                          [&](const dvec3&) { return wind(t); });
      frames.push_back({t, {}});
    }
    for (int n = 0; n < count; ++n) {
      for (std::size_t c = 0; c < 3; ++c) {
        frames[static_cast<std::size_t>(n)].components[c] =
            fields[static_cast<std::size_t>(n)].values[c].data();
      }
    }
  }
};

// x' = cos(t + 0.7), y' = 0.25: x = sin(t + 0.7) - sin(0.7), y = t / 4.
double wave_miss(int frames) {
  const WindFrames wind(-4, 5, frames, [](double t) { return dvec3(std::cos(t + 0.7), 0.25, 0); });
  Streamlines of = wind.fields[0].lines();
  of.flow.frames = wind.frames;
  of.seeds = {{8, 8, 0}};
  of.back = 4;
  of.ahead = 5;
  const auto chains = chains_of(make_streamlines(of));
  EXPECT_EQ(chains.size(), 1U);
  EXPECT_NEAR(chains[0].front().y, -1, 1e-6);
  EXPECT_NEAR(chains[0].back().y, 1.25, 1e-6);
  double most = 0;
  for (const dvec3& at : chains[0]) {
    most = std::max(most, std::abs(at.x - std::sin(4 * at.y + 0.7) + std::sin(0.7)));
  }
  return most;
}

TEST(Pathlines, AnOscillatingWindMovesThemAlongAWaveToSecondOrderInTheSteps) {
  // The mean of cos between points h apart is h^2 / 12 of it larger than linear: of ways up
  // to 1.64.
  EXPECT_LT(wave_miss(46), 6e-3);
  EXPECT_GT(wave_miss(46) / wave_miss(91), 3.5);
}

// Linear between frames, the way is that of the trapezoidal rule, with one sign of the wind and
// with a change.
TEST(Pathlines, ALinearChangeOfTheWindIsIntegratedExactly) {
  const WindFrames wind(0, 4, 3, [](double t) { return dvec3(2 - t, 0, 0); });
  Streamlines of = wind.fields[0].lines();
  of.flow.frames = wind.frames;
  of.seeds = {{6, 8, 0}};
  of.time = 0;
  of.ahead = 3;
  of.longest = 0.05;
  const Segments made = make_streamlines(of);
  const auto chains = chains_of(made);
  ASSERT_EQ(chains.size(), 1U);
  double farthest = -10;
  for (const dvec3& at : chains[0]) farthest = std::max(farthest, at.x);
  EXPECT_NEAR(farthest, 0, 1e-3);               // 2 t - t^2 / 2 at t = 2
  EXPECT_NEAR(chains[0].back().x, -0.5, 1e-6);  // and at t = 3
  EXPECT_EQ(made.tally.ends[static_cast<std::size_t>(End::length)], 2);
}

TEST(Pathlines, AParticleAtRestWaitsForTheWind) {
  const WindFrames wind(0, 2, 3, [](double t) { return dvec3(t > 1.5 ? 4 : 0, 0, 0); });
  Streamlines of = wind.fields[0].lines();
  of.flow.frames = wind.frames;
  of.seeds = {{8, 8, 0}};
  of.ahead = 2;
  const auto chains = chains_of(make_streamlines(of));
  ASSERT_EQ(chains.size(), 1U);
  EXPECT_NEAR(chains[0].back().x, 2, 1e-6);
}

TEST(Pathlines, LeaveTheDataAndEndInWhatIsMaskedInOneOfTwoFrames) {
  WindFrames wind(0, 8, 2, [](double) { return dvec3(2, 0, 0); });
  Streamlines of = wind.fields[0].lines();
  of.flow.frames = wind.frames;
  of.seeds = {{8, 8, 0}};
  of.ahead = 8;
  EXPECT_NEAR(chains_of(make_streamlines(of))[0].back().x, 8.5, 1e-6);
  wind.fields[1].values[0][17 * 8 + 12] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NEAR(chains_of(make_streamlines(of))[0].back().x, 3.5, 1e-6);
}

// Twice as fast on the right: dashes there are twice as long. All of them take the same time.
TEST(Dashes, DivideALineByTheTimeOfTheFlow) {
  const SeedField field({129, 3, 1}, {-8, 0, 0}, 0.125,
                        [](const dvec3& p) { return dvec3(std::clamp(2 + p.x, 1.0, 3.0), 0, 0); });
  Streamlines of = field.lines();
  of.seeds = {{64, 1, 0}};
  of.length = 6;
  of.longest = 0.25;
  of.full_magnitude = 2;
  of.dash = 0.5;  // where the flow has the magnitude 2, as at the seed: a quarter unit of time
  const Segments made = make_streamlines(of);
  ASSERT_FALSE(made.turns.empty());
  double all = 0;
  for (std::size_t v = 0; v < made.vertices(); ++v) {
    if (!(made.magnitudes[v] > 0)) continue;
    const double slow = made.places[v + 1][0] < -1 ? 1 : 0;
    const double fast = made.places[v][0] > 1 ? 1 : 0;
    const double length = made.places[v + 1][0] - made.places[v][0];
    if (slow > 0) {
      EXPECT_NEAR(made.turns[v], length / 0.25, 1e-4);
    }
    if (fast > 0) {
      EXPECT_NEAR(made.turns[v], length / 0.75, 1e-4);
    }
    all += made.turns[v];
    // Each segment goes on where the last one ended.
    const double next = made.phases[v] + made.turns[v];
    if (made.magnitudes[v + 1] > 0) {
      EXPECT_NEAR(std::remainder(next - static_cast<double>(made.phases[v + 1]), 1.0), 0, 1e-5);
    }
  }
  // 5 units at the speed 1, 2 between 1 and 3, and 5 at 3.
  EXPECT_NEAR(all, (5 + std::log(3.0) + 5.0 / 3) / 0.25, 1e-3);
}

TEST(Streamlines, EachIsThatOfItsSeedAlone) {
  const SeedField field = solid_rotation();
  Streamlines of = field.lines();
  of.length = 7;
  for (int n = 0; n < 50; ++n) of.seeds.emplace_back(17 + 0.25 * n, 16, 0);
  const Segments all = make_streamlines(of);
  const auto chains = chains_of(all);
  ASSERT_EQ(chains.size(), of.seeds.size());
  for (const std::size_t n : {0U, 15U, 16U, 49U}) {
    Streamlines one = of;
    one.seeds = {of.seeds[n]};
    EXPECT_EQ(chains_of(make_streamlines(one))[0], chains[n]);
  }
  EXPECT_LE(all.vertices(), static_cast<std::size_t>(
                                room_of(of, static_cast<std::int64_t>(of.seeds.size())).vertices));
}

TEST(Streamlines, ACancelledTracingEndsAtOnce) {
  const SeedField field = solid_rotation();
  Streamlines of = field.lines();
  of.seeds.assign(1000, {26, 16, 0});
  of.length = 1000;
  const CancelToken cancel;
  cancel.cancel();
  EXPECT_EQ(make_streamlines(of, cancel).tally.evaluations, 0);
}

// Places of 2000 seeds among eight equal parts of the world, on an axis whose cells grow.
TEST(EvenSeeds, FillTheWorldByVolume) {
  SeedField field({41, 20, 20}, {0, 0, 0}, 1, [](const dvec3&) { return dvec3(1, 0, 0); });
  for (int i = 0; i < 41; ++i) {
    field.positions[0][static_cast<std::size_t>(i)] = 0.02 * i * i;
    field.spacing[0][static_cast<std::size_t>(i)] = 0.04 * std::max(i, 1);
  }
  const Streamlines of = field.lines();
  const std::vector<dvec3> seeds = evenly(of.flow, 2000);
  ASSERT_EQ(seeds.size(), 2000U);
  std::array<int, 4> along_x{};
  std::array<int, 2> along_z{};
  for (const dvec3& index : seeds) {
    const dvec3 at = of.flow.place(index);
    ++along_x[static_cast<std::size_t>(std::clamp(at.x / 8, 0.0, 3.0))];
    ++along_z[at.z < 9.5 ? 0 : 1];
  }
  for (const int count : along_x) EXPECT_NEAR(count, 500, 40);
  for (const int count : along_z) EXPECT_NEAR(count, 1000, 20);
  EXPECT_EQ(evenly(of.flow, 2000), seeds);
}

TEST(EvenSeeds, AvoidWhatIsMasked) {
  SeedField field({20, 20, 1}, {0, 0, 0}, 1, [](const dvec3&) { return dvec3(1, 0, 0); });
  for (std::size_t n = 0; n < field.values[0].size(); ++n) {
    if (n % 20 < 15) field.values[0][n] = std::numeric_limits<float>::quiet_NaN();
  }
  Streamlines of = field.lines();
  const std::vector<dvec3> seeds = evenly(of.flow, 60);
  EXPECT_EQ(seeds.size(), 60U);
  for (const dvec3& index : seeds) {
    EXPECT_GE(index.x, 14.5);
    EXPECT_EQ(index.z, 0);
  }
  std::fill(field.values[0].begin(), field.values[0].end(),
            std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(evenly(of.flow, 60).empty());
}

}  // namespace
}  // namespace windsplat::trace
