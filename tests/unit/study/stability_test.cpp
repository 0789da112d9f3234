// The stiffness sweep through the engine: predictions of the one-kernel formulas for every
// compositing operator.
#include "server/study/stability.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace windsplat::study {
namespace {

using scene::Compositing;

std::vector<Stiffness> sweep_of(Compositing compositing) {
  ThreadPool pool(1);
  const auto all = stiffness_sweep(pool, CancelToken());
  std::vector<Stiffness> out;
  for (const Stiffness& one : all.value()) {
    if (one.compositing == compositing) out.push_back(one);
  }
  return out;
}

TEST(Stability, AnalyticIsExactBoundedAndMonotoneAtEveryStiffness) {
  const auto sweep = sweep_of(Compositing::analytic);
  ASSERT_EQ(sweep.size(), stiffness().size());
  for (const Stiffness& s : sweep) {
    EXPECT_LT(s.error, 1e-6) << s.tau;
    EXPECT_TRUE(s.bounded) << s.tau;
    EXPECT_TRUE(s.monotone) << s.tau;
    EXPECT_FALSE(s.diverges) << s.tau;
  }
}

// No tolerance beyond float rounding: bounded methods are bounded at every optical depth.
TEST(Stability, CorrectedAndAnalyticStayWithinTheUnitInterval) {
  constexpr double rounding = 1e-6;
  for (const Compositing compositing : {Compositing::cd, Compositing::analytic}) {
    for (const Stiffness& s : sweep_of(compositing)) {
      SCOPED_TRACE(testing::Message() << name_of(compositing) << " " << s.tau);
      EXPECT_GE(s.min, 0);
      EXPECT_LE(s.max, 1 + rounding);
      EXPECT_GE(s.layers_min, 0);
      EXPECT_LE(s.layers_max, 1 + rounding);
      EXPECT_TRUE(s.monotone);
      EXPECT_FALSE(s.diverges);
    }
  }
}

// exp(-tau x) and its chord 1 - x (1 - exp(-tau)) differ by at most tau^2 / 8, and by less than 1;
// times the opacity 0.6 of the line and the largest distance 0.7 of its colour from that of the
// medium. The error grows with tau, so that exact results do not satisfy the test.
TEST(Stability, ChordOfCorrectedDeviatesByAtMostAnEighthOfTheSquare) {
  for (const Stiffness& s : sweep_of(Compositing::cd)) {
    const double most = 0.6 * 0.7 * std::min(1.0, s.tau * s.tau / 8);
    EXPECT_LE(s.error, most + 1e-6) << s.tau;
    if (s.tau >= 0.1) {
      EXPECT_GE(s.error, 0.25 * std::min(most, 0.3)) << s.tau;
    }
  }
}

// The transmittance of n layers is (1 - tau)^n: above tau = 1 the first layer leaves [0, 1], below
// 2 later layers correct that, for 2 and above they do not.
TEST(Stability, EulerLeavesTheUnitIntervalAboveOneAndDivergesFromTwo) {
  for (const Stiffness& s : sweep_of(Compositing::cd_euler)) {
    EXPECT_EQ(s.bounded, s.tau <= 1) << s.tau;
    EXPECT_EQ(s.diverges, s.tau >= 2) << s.tau;
    if (s.tau == 2 || s.tau == 3) {
      EXPECT_NEAR(s.layers_max, 1 + std::pow(s.tau - 1, stiff_layers), 1e-4 * s.layers_max);
    }
    if (s.tau >= 10) {
      EXPECT_GT(s.layers_max, 1e6 * s.max) << s.tau;
    }
  }
}

TEST(Stability, SimpleAndNaiveAreBoundedButInaccurate) {
  for (const Compositing compositing : {Compositing::simple, Compositing::cd_naive}) {
    double worst = 0;
    for (const Stiffness& s : sweep_of(compositing)) {
      EXPECT_TRUE(s.bounded) << s.tau;
      EXPECT_FALSE(s.diverges) << s.tau;
      worst = std::max(worst, s.error);
    }
    EXPECT_GT(worst, 0.1) << name_of(compositing);
  }
}

}  // namespace
}  // namespace windsplat::study
