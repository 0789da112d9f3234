// Costs of pictures, learned from those that were drawn.
#include "server/tasks/request_times.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

namespace windsplat::tasks {
namespace {

constexpr auto slab = protocol::MethodName::slab;
constexpr auto kernel = protocol::MethodName::kernel;

TEST(RequestTimes, UseTypicalCostsForUnknownOnes) {
  const RequestTimes times(2);
  EXPECT_DOUBLE_EQ(times.estimate_ms("a", slab, 1e6), 3) << "6 ns of a thread's time";
  EXPECT_DOUBLE_EQ(RequestTimes(6).estimate_ms("a", slab, 1e6), 1);
}

TEST(RequestTimes, FollowWorkAndTimesByDatasetAndMethod) {
  RequestTimes times(2);
  times.learn("a", slab, 1e6, 2000);
  EXPECT_DOUBLE_EQ(times.estimate_ms("a", slab, 5e5), 1);
  EXPECT_DOUBLE_EQ(times.estimate_ms("a", kernel, 1e6), 3);
  EXPECT_DOUBLE_EQ(times.estimate_ms("b", slab, 1e6), 3);
  for (int i = 0; i < 50; ++i) times.learn("a", slab, 1e6, 10'000);
  EXPECT_NEAR(times.estimate_ms("a", slab, 1e6), 10, 0.01);
  for (int i = 0; i < 100; ++i) times.learn("a", slab, 1e6, 2000);
  EXPECT_NEAR(times.estimate_ms("a", slab, 1e6), 2, 0.01);
}

TEST(RequestTimes, AreAboveMostMeasuredCosts) {
  RequestTimes times(2);
  int above = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t took_us = 1000 + 100 * (i * 7 % 41);  // 1 to 5 ms, uniformly distributed
    if (times.estimate_ms("a", slab, 1e6) * 1000 >= static_cast<double>(took_us)) ++above;
    times.learn("a", slab, 1e6, took_us);
  }
  EXPECT_GT(above, 650);
  EXPECT_LT(above, 950);
}

TEST(RequestTimes, OfEncodingFollowPixelsAndFormat) {
  RequestTimes times(2);
  const double jpeg = times.encoding_ms(frame::Format::jpeg, 1e6);
  EXPECT_GT(times.encoding_ms(frame::Format::png, 1e6), jpeg);
  for (int i = 0; i < 100; ++i) times.learn_encoding(frame::Format::png, 2e6, 160'000);
  EXPECT_NEAR(times.encoding_ms(frame::Format::png, 1e6), 80, 0.1);
  EXPECT_DOUBLE_EQ(times.encoding_ms(frame::Format::jpeg, 1e6), jpeg);
}

TEST(RequestTimes, OfEncodingAreLearntForEveryFormat) {
  using frame::Format;
  for (const Format format : {Format::jpeg, Format::png, Format::npy, Format::pdf, Format::svg}) {
    RequestTimes times(2);
    EXPECT_GT(times.encoding_ms(format, 1e6), 0);
    for (int i = 0; i < 100; ++i) times.learn_encoding(format, 1e6, 300'000);
    EXPECT_NEAR(times.encoding_ms(format, 1e6), 300, 0.1);
  }
}

TEST(RequestTimes, OfDescribingFollowTheDataset) {
  RequestTimes times(2);
  EXPECT_DOUBLE_EQ(times.describing_ms("a"), RequestTimes::describing_ms_unknown);
  for (int i = 0; i < 100; ++i) times.learn_describing("a", 200'000);
  EXPECT_NEAR(times.describing_ms("a"), 200, 0.1);
  EXPECT_DOUBLE_EQ(times.describing_ms("b"), RequestTimes::describing_ms_unknown);
  for (int i = 0; i < 100; ++i) times.learn_describing("a", 10'000);
  EXPECT_NEAR(times.describing_ms("a"), 10, 0.1);
}

// A suspension of the machine during a picture must not cause pictures to be refused permanently.
TEST(RequestTimes, IgnoreOutliers) {
  RequestTimes times(2);
  times.learn("a", slab, 1e6, 3'600'000'000);
  EXPECT_DOUBLE_EQ(times.estimate_ms("a", slab, 1e6), 50);
}

TEST(RequestTimes, ForgetTheLeastRecentlyRenderedDataset) {
  RequestTimes times(2);
  times.learn("first", slab, 1e6, 1000);
  times.learn("second", slab, 1e6, 1000);
  times.learn("first", slab, 1e6, 1000);
  for (std::size_t i = 0; i + 1 < RequestTimes::known_max; ++i) {
    times.learn("more-" + std::to_string(i), slab, 1e6, 1000);
  }
  EXPECT_DOUBLE_EQ(times.estimate_ms("second", slab, 1e6), 3) << "unknown again";
  EXPECT_DOUBLE_EQ(times.estimate_ms("first", slab, 1e6), 1);
}

}  // namespace
}  // namespace windsplat::tasks
