// Limits on waiting loads: per dataset, in total, and exemptions.
#include "server/tasks/task_executor.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <thread>

namespace windsplat::tasks {
namespace {

TEST(TaskExecutor, LimitsWaitingJobsPerDatasetAndInTotal) {
  constexpr std::size_t most = 3;
  std::promise<void> let_go;
  const std::shared_future<void> gone = let_go.get_future().share();
  std::promise<void> begun;
  std::atomic<int> ran{0};
  int refusals = 0;
  TaskExecutor loads({"loads", 1, most}, [&] { ++refusals; });
  ASSERT_TRUE(loads.submit({{}, [&] {
                              begun.set_value();
                              gone.wait();
                            }}));
  begun.get_future().wait();
  const auto ask = [&](const std::shared_ptr<const void>& dataset, bool admitted = false) {
    const CancelToken cancel;
    const auto queued = loads.submit({cancel, [&] { ++ran; }, admitted, dataset});
    if (!queued) {
      EXPECT_EQ(queued.error().kind, ErrorKind::busy);
    }
    return static_cast<bool>(queued);
  };
  int taken = 0;
  for (std::size_t n = 0; n < TaskExecutor::keys_full; ++n) {
    const auto dataset = std::make_shared<const int>(0);
    for (std::size_t one = 0; one < most; ++one) taken += ask(dataset) ? 1 : 0;
    EXPECT_FALSE(ask(dataset)) << n;
  }
  EXPECT_EQ(taken, static_cast<int>(most * TaskExecutor::keys_full));
  EXPECT_FALSE(ask(std::make_shared<const int>(0))) << "the limit of all datasets";
  EXPECT_TRUE(ask(nullptr, true)) << "was admitted before";
  EXPECT_EQ(refusals, static_cast<int>(TaskExecutor::keys_full) + 1);
  let_go.set_value();
  loads.end();
  EXPECT_EQ(ran, taken + 1);
}

TEST(TaskExecutor, OnePayerMayUseHalfOfTheSlots) {
  std::promise<void> let_go;
  std::promise<void> begun;
  TaskExecutor loads({"loads", 1, 4});
  ASSERT_TRUE(loads.submit({{}, [&] {
                              begun.set_value();
                              let_go.get_future().wait();
                            }}));
  begun.get_future().wait();
  const auto one = std::make_shared<const int>(0);
  const auto ask = [&](const std::shared_ptr<const void>& dataset, const char* payer) {
    return static_cast<bool>(loads.submit({{}, [] {}, false, dataset, payer}));
  };
  EXPECT_TRUE(ask(one, "a"));
  EXPECT_TRUE(ask(one, "a"));
  EXPECT_FALSE(ask(one, "a")) << "half of the slots of a dataset";
  EXPECT_TRUE(ask(one, "b"));
  EXPECT_TRUE(ask(one, "b"));
  for (int n = 0; n < 6; ++n) EXPECT_TRUE(ask(std::make_shared<const int>(n), "a")) << n;
  EXPECT_FALSE(ask(std::make_shared<const int>(0), "a")) << "half of all";
  EXPECT_TRUE(ask(std::make_shared<const int>(0), "b"));
  let_go.set_value();
}

// Loads that wait for memory or block on their files.
TEST(TaskExecutor, LongRunningJobsReleaseTheirSlotsToSpareThreads) {
  constexpr std::size_t places = 2;
  constexpr std::size_t spare = 2;
  std::promise<void> let_go;
  const std::shared_future<void> gone = let_go.get_future().share();
  std::atomic<std::size_t> hanging{0};
  TaskExecutor loads({"loads", places, 16, spare});
  const auto hang = [&] {
    EXPECT_TRUE(loads.submit({{},
                              [&hanging, gone] {
                                ++hanging;
                                gone.wait();
                              },
                              true,
                              std::make_shared<const int>(0)}));
  };
  const auto run_one = [&] {
    auto done = std::make_shared<std::promise<void>>();
    EXPECT_TRUE(
        loads.submit({{}, [done] { done->set_value(); }, true, std::make_shared<const int>(0)}));
    return done->get_future();
  };
  for (std::size_t n = 0; n < places; ++n) hang();
  auto beside_two = run_one();
  auto also_beside_two = run_one();
  EXPECT_EQ(beside_two.wait_for(std::chrono::minutes(1)), std::future_status::ready);
  EXPECT_EQ(also_beside_two.wait_for(std::chrono::minutes(1)), std::future_status::ready);
  for (std::size_t n = 0; n < spare; ++n) hang();
  while (hanging < places + spare) std::this_thread::yield();
  auto beside_all = run_one();
  EXPECT_EQ(beside_all.wait_for(2 * TaskExecutor::long_run), std::future_status::timeout);
  let_go.set_value();
  EXPECT_EQ(beside_all.wait_for(std::chrono::minutes(1)), std::future_status::ready);
}

}  // namespace
}  // namespace windsplat::tasks
