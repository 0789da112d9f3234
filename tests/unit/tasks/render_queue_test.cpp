// The order of renders: shares of time, cancelled background jobs. Times are simulated.
#include "server/tasks/render_queue.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

namespace windsplat::tasks {
namespace {

RenderJob job_of(RenderKind kind, std::uint64_t owner) {
  RenderJob out;
  out.kind = kind;
  out.owner = owner;
  return out;
}

// Owners that always have work: each submits its next job as soon as one was started.
class Renderer {
 public:
  void ask(RenderKind kind, std::uint64_t owner) { queue_.push(job_of(kind, owner), now_us_); }

  // Runs one job with the cost of its owner in `cost_us`; returns the owner.
  std::uint64_t run(std::map<std::uint64_t, std::int64_t> cost_us, bool ask_again = true) {
    const auto next = queue_.pop();
    if (!next) return 0;
    if (ask_again) ask(next->job.kind, next->job.owner);
    const std::int64_t took = cost_us[next->job.owner];
    now_us_ += took;
    queue_.done(took);
    used_us[next->job.owner] += took;
    ++jobs[next->job.owner];
    return next->job.owner;
  }

  std::map<std::uint64_t, std::int64_t> used_us;
  std::map<std::uint64_t, int> jobs;

 private:
  RenderQueue queue_;
  std::int64_t now_us_ = 0;
};

TEST(RenderQueue, GivesOwnersEqualTimesNotEqualJobCounts) {
  Renderer renderer;
  renderer.ask(RenderKind::stream, 1);
  renderer.ask(RenderKind::stream, 2);
  for (int i = 0; i < 400; ++i) renderer.run({{1, 30'000}, {2, 10'000}});
  EXPECT_NEAR(static_cast<double>(renderer.used_us[1]), static_cast<double>(renderer.used_us[2]),
              30'000);
  EXPECT_NEAR(renderer.jobs[2], 3 * renderer.jobs[1], 3);
}

// Of 48 sessions each draws one frame in a hundred that takes ten times as long. Each repays it
// with its later frames instead of waiting ten rounds for the next one.
TEST(RenderQueue, OneLongFrameDoesNotKeepItsSessionWaiting) {
  RenderQueue queue;
  std::int64_t now_us = 0;
  constexpr std::uint64_t sessions = 48;
  std::map<std::uint64_t, int> drawn;
  std::map<std::uint64_t, std::int64_t> used_us;
  std::vector<std::int64_t> waited;
  const auto ask = [&](std::uint64_t owner) {
    RenderJob job;
    job.kind = RenderKind::stream;
    job.owner = owner;
    queue.push(std::move(job), now_us);
  };
  for (std::uint64_t owner = 1; owner <= sessions; ++owner) ask(owner);
  for (int n = 0; n < 10'000; ++n) {
    const auto next = queue.pop(now_us);
    ASSERT_TRUE(next);
    const std::uint64_t owner = next->job.owner;
    const bool is_long = (++drawn[owner] + 7 * owner) % 100 == 0;
    const std::int64_t took_us = is_long ? 30'000 : 3'000;
    now_us += took_us;
    used_us[owner] += took_us;
    waited.push_back(now_us - next->since_us);
    queue.done(took_us);
    ask(owner);
  }
  std::sort(waited.begin(), waited.end());
  EXPECT_LE(waited[waited.size() * 99 / 100], 2 * waited[waited.size() / 2]);
  EXPECT_LE(waited[waited.size() * 997 / 1000], 3 * waited[waited.size() / 2]);
  for (const auto& [owner, used] : used_us) EXPECT_NEAR(used, now_us / sessions, 200'000) << owner;
}

TEST(RenderQueue, SharesTimeEquallyBetweenStreamsAndRequests) {
  Renderer renderer;
  for (std::uint64_t owner = 1; owner <= 5; ++owner) renderer.ask(RenderKind::stream, owner);
  renderer.ask(RenderKind::request, 9);
  for (int i = 0; i < 600; ++i) {
    renderer.run({{1, 10}, {2, 10}, {3, 10}, {4, 10}, {5, 10}, {9, 100}});
  }
  std::int64_t streams = 0;
  for (std::uint64_t owner = 1; owner <= 5; ++owner) streams += renderer.used_us[owner];
  EXPECT_NEAR(static_cast<double>(streams), static_cast<double>(renderer.used_us[9]), 100);
}

TEST(RenderQueue, IdleOwnerCannotReclaimItsUnusedShare) {
  Renderer renderer;
  const std::map<std::uint64_t, std::int64_t> costs{{1, 10}, {2, 10}};
  renderer.ask(RenderKind::stream, 1);
  renderer.ask(RenderKind::stream, 2);
  EXPECT_NE(renderer.run(costs, false), renderer.run(costs, false));
  renderer.ask(RenderKind::stream, 1);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(renderer.run(costs), 1U);
  renderer.ask(RenderKind::stream, 2);
  renderer.jobs.clear();
  for (int i = 0; i < 20; ++i) renderer.run(costs);
  EXPECT_NEAR(renderer.jobs[1], 10, 1);
  EXPECT_NEAR(renderer.jobs[2], 10, 1);
}

TEST(RenderQueue, ShortPauseDoesNotResetTheShareOfAnOwner) {
  Renderer renderer;
  for (std::uint64_t owner = 1; owner <= 3; ++owner) renderer.ask(RenderKind::stream, owner);
  const std::map<std::uint64_t, std::int64_t> costs{{1, 1000}, {2, 10}, {3, 10}};
  EXPECT_EQ(renderer.run(costs, false), 1U) << "among equals the first to arrive";
  renderer.ask(RenderKind::stream, 1);
  for (int i = 0; i < 198; ++i) EXPECT_NE(renderer.run(costs), 1U);
}

TEST(Shares, ForgetIdleOwnersThatAreNotAhead) {
  Shares shares;
  shares.come(1);
  for (std::uint64_t party = 2; party < 1000; ++party) {
    shares.come(party);
    shares.begin(party);
    shares.charge(party, 10);
    shares.rest(party);
    shares.begin(1);
    shares.charge(1, 10);
    EXPECT_LE(shares.known(), 3U);
  }
  shares.rest(1);
  EXPECT_EQ(shares.known(), 0U);
}

TEST(RenderQueue, BackgroundWaitsForAllOthers) {
  Renderer renderer;
  const std::map<std::uint64_t, std::int64_t> costs{{1, 10}, {2, 10}, {3, 10}};
  renderer.ask(RenderKind::background, 1);
  renderer.ask(RenderKind::stream, 2);
  renderer.ask(RenderKind::request, 3);
  EXPECT_NE(renderer.run(costs, false), 1U);
  EXPECT_NE(renderer.run(costs, false), 1U);
  EXPECT_EQ(renderer.run(costs, false), 1U);
}

TEST(RenderQueue, BackgroundWorkInItsTurnInterruptsNoOtherAndRefusesNobody) {
  RenderQueue queue;
  const RenderJob job = job_of(RenderKind::background, 1);
  queue.push(job, 0);
  ASSERT_TRUE(queue.pop());
  RenderJob turn = job_of(RenderKind::request, 2);
  turn.payer = "a";
  turn.cost_ms = 1000;
  turn.is_background_turn = true;
  queue.push(turn, 0);
  EXPECT_FALSE(job.cancel.cancelled());
  EXPECT_EQ(queue.requests_waiting().count, 0U);
  EXPECT_EQ(queue.requests_before("b", 0).cost_ms, 0);
  queue.done(1);
  ASSERT_TRUE(queue.pop());
  EXPECT_TRUE(queue.empty());
}

TEST(RenderQueue, RunningBackgroundJobIsCancelledByOtherJobsOnly) {
  for (const RenderKind kind : {RenderKind::stream, RenderKind::request, RenderKind::background}) {
    RenderQueue queue;
    const RenderJob job = job_of(RenderKind::background, 1);
    queue.push(job, 0);
    ASSERT_TRUE(queue.pop());
    EXPECT_FALSE(job.cancel.cancelled());
    queue.push(job_of(kind, 2), 0);
    EXPECT_EQ(job.cancel.cancelled(), kind != RenderKind::background);
    queue.done(1);
    const auto next = queue.pop();
    ASSERT_TRUE(next);
    EXPECT_EQ(next->job.owner, 2U) << "it is not run again";
    EXPECT_FALSE(next->job.cancel.cancelled());
    queue.done(1);
    EXPECT_TRUE(queue.empty());
  }
}

TEST(RenderQueue, NewerBackgroundJobReplacesTheOlderWithNotice) {
  RenderQueue queue;
  const auto push = [&](RenderKind kind, std::uint64_t owner) {
    RenderJob job;
    job.kind = kind;
    job.owner = owner;
    queue.push(job, 0);
    return job.cancel;
  };
  const CancelToken other = push(RenderKind::background, 2);
  const CancelToken older = push(RenderKind::background, 1);
  const CancelToken newer = push(RenderKind::background, 1);
  EXPECT_TRUE(older.cancelled());
  EXPECT_FALSE(newer.cancelled());
  EXPECT_FALSE(other.cancelled());
  push(RenderKind::stream, 3);
  std::vector<std::pair<std::uint64_t, bool>> ran;
  while (const auto next = queue.pop()) {
    ran.emplace_back(next->job.owner, next->job.cancel.cancelled());
    queue.done(1);
  }
  const std::vector<std::pair<std::uint64_t, bool>> expected{
      {1, true}, {3, false}, {2, false}, {1, false}};
  EXPECT_EQ(ran, expected);
}

// Cancelled jobs of a closed session: new owners without usage run before them.
TEST(RenderQueue, CancelledJobDoesNotWaitForItsTurn) {
  for (const RenderKind kind : {RenderKind::stream, RenderKind::request, RenderKind::background}) {
    SCOPED_TRACE(static_cast<int>(kind));
    RenderQueue queue;
    queue.push(job_of(kind, 1), 0);
    queue.pop();
    RenderJob second = job_of(kind, 1);
    const CancelToken gone = second.cancel;
    queue.push(std::move(second), 0);
    queue.done(100'000);
    for (std::uint64_t newcomer = 2; newcomer < 5; ++newcomer) {
      queue.push(job_of(RenderKind::stream, newcomer), 0);
    }
    EXPECT_EQ(queue.pop()->job.owner, 2U) << "the first owner has used more";
    queue.done(10'000);
    gone.cancel();
    EXPECT_EQ(queue.pop()->job.owner, 1U);
    queue.done(0);
    EXPECT_EQ(queue.pop()->job.owner, 3U);
    queue.done(10'000);
    EXPECT_EQ(queue.pop()->job.owner, 4U);
    queue.done(10'000);
    EXPECT_TRUE(queue.empty());
  }
}

TEST(RenderQueue, CountsJobsThatAreStillAwaited) {
  RenderQueue queue;
  RenderJob job;
  job.cost_ms = 100;
  queue.push(job, 0);
  RenderJob left;
  left.cost_ms = 1000;
  queue.push(left, 0);
  RenderJob stream;
  stream.kind = RenderKind::stream;
  queue.push(stream, 0);
  left.cancel.cancel();
  EXPECT_EQ(queue.requests_waiting().count, 1U);
  EXPECT_DOUBLE_EQ(queue.requests_waiting().cost_ms, 100);
}

TEST(RenderQueue, UsesTheGivenCostForJobsOfUnknownCost) {
  RenderQueue queue;
  RenderJob job;
  job.payer = "a";
  job.run = [](std::int64_t /*queue_us*/) {};
  queue.push(job, 0);
  job.cost_ms = 30;
  queue.push(job, 0);
  job.payer = "b";
  queue.push(job, 0);
  EXPECT_EQ(queue.requests_before("c", 50).cost_ms, 80) << "one of a's, one of b's";
  EXPECT_EQ(queue.requests_before("c", 50).count, 2U);
  EXPECT_EQ(queue.requests_before("b", 50).cost_ms, 50);
  EXPECT_EQ(queue.requests_before("a", 50).cost_ms, 30);
  EXPECT_EQ(queue.rest_ms(0), 0);
  (void)queue.pop(1000);
  (void)queue.pop(1000);
  EXPECT_EQ(queue.rest_ms(11'000), 20);
  EXPECT_EQ(queue.rest_ms(99'000), 0);
}

}  // namespace
}  // namespace windsplat::tasks
