// The stiffness sweep through the engine: what the formulas of one kernel say of every compositing.
#include "server/study/stability.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace windsplat::study
