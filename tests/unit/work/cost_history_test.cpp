// Costs of pictures, learnt from those that were drawn.
#include "server/work/cost_history.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

namespace windsplat::work {
namespace {

constexpr auto slab = protocol::MethodName::slab;
constexpr auto kernel = protocol::MethodName::kernel;

TEST(RenderCosts, UseTypicalCostsForUnknownOnes) {
  const RenderCosts costs(2);
  EXPECT_DOUBLE_EQ(costs.estimate_ms("a", slab, 1e6), 3) << "6 ns of a thread's time";
  EXPECT_DOUBLE_EQ(RenderCosts(6).estimate_ms("a", slab, 1e6), 1);
}

TEST(RenderCosts, FollowWorkAndTimesByDatasetAndMethod) {
  RenderCosts costs(2);
  costs.learn("a", slab, 1e6, 2000);
  EXPECT_DOUBLE_EQ(costs.estimate_ms("a", slab, 5e5), 1);
  EXPECT_DOUBLE_EQ(costs.estimate_ms("a", kernel, 1e6), 3);
  EXPECT_DOUBLE_EQ(costs.estimate_ms("b", slab, 1e6), 3);
  for (int i = 0; i < 50; ++i) costs.learn("a", slab, 1e6, 10'000);
  EXPECT_NEAR(costs.estimate_ms("a", slab, 1e6), 10, 0.01);
  for (int i = 0; i < 100; ++i) costs.learn("a", slab, 1e6, 2000);
  EXPECT_NEAR(costs.estimate_ms("a", slab, 1e6), 2, 0.01);
}

TEST(RenderCosts, AreAboveMostMeasuredCosts) {
  RenderCosts costs(2);
  int above = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t took_us = 1000 + 100 * (i * 7 % 41);  // 1 to 5 ms, evenly
    if (costs.estimate_ms("a", slab, 1e6) * 1000 >= static_cast<double>(took_us)) ++above;
    costs.learn("a", slab, 1e6, took_us);
  }
  EXPECT_GT(above, 650);
  EXPECT_LT(above, 950);
}

// A machine that slept in the middle of a picture has none refused for good.
TEST(RenderCosts, IgnoreOutliers) {
  RenderCosts costs(2);
  costs.learn("a", slab, 1e6, 3'600'000'000);
  EXPECT_DOUBLE_EQ(costs.estimate_ms("a", slab, 1e6), 50);
}

TEST(RenderCosts, ForgetTheLeastRecentlyRenderedDataset) {
  RenderCosts costs(2);
  costs.learn("first", slab, 1e6, 1000);
  costs.learn("second", slab, 1e6, 1000);
  costs.learn("first", slab, 1e6, 1000);
  for (std::size_t i = 0; i + 1 < RenderCosts::known_max; ++i) {
    costs.learn("more-" + std::to_string(i), slab, 1e6, 1000);
  }
  EXPECT_DOUBLE_EQ(costs.estimate_ms("second", slab, 1e6), 3) << "unknown again";
  EXPECT_DOUBLE_EQ(costs.estimate_ms("first", slab, 1e6), 1);
}

}  // namespace
}  // namespace windsplat::work
