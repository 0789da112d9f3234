// Scheduling of the renderer: shares of time, cancelled background jobs, refusals, in simulated
// time.
#include "server/work/render_queue.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "server/http/problem.hpp"
#include "server/work/cost_history.hpp"
#include "server/work/render_service.hpp"

namespace windsplat::net {
namespace {

// Owners with permanent demand: each submits its next job when one starts.
class Renderer {
 public:
  RenderJob job(RenderKind kind, std::uint64_t owner) {
    RenderJob out;
    out.kind = kind;
    out.owner = owner;
    return out;
  }
  void ask(RenderKind kind, std::uint64_t owner) { queue_.push(job(kind, owner), now_us_); }

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
  EXPECT_EQ(renderer.run(costs, false), 1U) << "first come, first served among equals";
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

TEST(RenderQueue, RunningBackgroundJobIsCancelledByOtherJobsOnly) {
  for (const RenderKind kind : {RenderKind::stream, RenderKind::request, RenderKind::background}) {
    RenderQueue queue;
    RenderJob job;
    job.kind = RenderKind::background;
    job.owner = 1;
    queue.push(job, 0);
    ASSERT_TRUE(queue.pop());
    EXPECT_FALSE(job.cancel.cancelled());
    RenderJob other;
    other.kind = kind;
    other.owner = 2;
    queue.push(other, 0);
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
    Renderer make;
    RenderQueue queue;
    queue.push(make.job(kind, 1), 0);
    queue.pop();
    RenderJob second = make.job(kind, 1);
    const CancelToken gone = second.cancel;
    queue.push(std::move(second), 0);
    queue.done(100'000);
    for (std::uint64_t newcomer = 2; newcomer < 5; ++newcomer) {
      queue.push(make.job(RenderKind::stream, newcomer), 0);
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

// A service whose thread is blocked in a job of a stream until release() or the end.
class HeldService {
 public:
  explicit HeldService(RenderService::Options options = {}) : service_(std::move(options)) {
    RenderJob job;
    job.kind = RenderKind::stream;
    job.run = [this](std::int64_t /*queue_us*/) {
      held_.set_value();
      gate_.get_future().wait();
    };
    EXPECT_TRUE(service_.submit(std::move(job)));
    held_.get_future().wait();
  }
  ~HeldService() { release(); }
  HeldService(const HeldService&) = delete;
  HeldService& operator=(const HeldService&) = delete;

  void release() {
    if (!released_) gate_.set_value();
    released_ = true;
  }
  Result<void> request(double cost_ms) {
    RenderJob job;
    job.cost_ms = cost_ms;
    job.run = [](std::int64_t /*queue_us*/) {};
    return service_.submit(std::move(job));
  }
  RenderService& service() { return service_; }

 private:
  std::promise<void> held_;
  std::promise<void> gate_;
  bool released_ = false;
  RenderService service_;  // last: its thread uses the above
};

TEST(RenderService, RefusesRequestsAboveItsEstimateOfWaitingWork) {
  HeldService held({16, 10'000, {}});
  EXPECT_TRUE(held.request(60'000)) << "one request is admitted at any cost";
  const auto refused = held.request(1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::busy);
  EXPECT_EQ(refused.error().retry_after_s, 60);
}

TEST(RenderService, EstimatesWhenWaitingWorkWillBeDone) {
  HeldService held({16, 10'000, {}});
  EXPECT_TRUE(held.request(4'200));
  EXPECT_TRUE(held.request(3'000));
  const auto refused = held.request(3'000);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().retry_after_s, 8) << "7.2 s, in whole seconds";
  EXPECT_NE(refused.error().message.find("8 s"), std::string::npos) << refused.error().message;
  EXPECT_TRUE(held.request(2'000)) << "there is room for a smaller one";
}

TEST(Problems, ContainARetryTimeInTheirHeader) {
  const auto retry_after = [](int seconds) {
    Error error = make_error(ErrorKind::busy, "later");
    error.retry_after_s = seconds;
    const Headers headers = problem_response(error).headers;
    const auto found = std::find_if(headers.begin(), headers.end(), [](const auto& header) {
      return header.first == "Retry-After";
    });
    return found == headers.end() ? "" : found->second;
  };
  EXPECT_EQ(retry_after(8), "8");
  EXPECT_EQ(retry_after(0), "1") << "unknown cost: retry soon";
}

TEST(RenderService, LimitsTheNumberOfJobsOfUnknownCost) {
  HeldService held({3, 10'000, {}});
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(held.request(0));
  const auto refused = held.request(0);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().retry_after_s, 1);
}

TEST(RenderService, AdmittedJobsAreNotRefusedLater) {
  HeldService held({1, 10, {}});
  EXPECT_TRUE(held.request(100));
  RenderJob rest;
  rest.cost_ms = 100;
  rest.admitted = true;
  rest.run = [](std::int64_t /*queue_us*/) {};
  EXPECT_TRUE(held.service().submit(std::move(rest)));
}

TEST(RenderService, ChargesMeasuredTimeAndReportsTheWait) {
  std::atomic<std::int64_t> now_us{0};
  std::vector<std::uint64_t> order;
  std::map<std::uint64_t, std::int64_t> queued_us;
  std::promise<void> done;
  HeldService held({16, 10'000, [&] { return now_us.load(); }});
  for (int i = 0; i < 12; ++i) {
    for (const std::uint64_t owner : {7U, 8U}) {
      RenderJob job;
      job.kind = RenderKind::stream;
      job.owner = owner;
      job.run = [&, owner](std::int64_t queue_us) {
        if (order.empty()) queued_us[owner] = queue_us;
        order.push_back(owner);
        now_us += owner == 7 ? 300 : 100;
        if (order.size() == 24) done.set_value();
      };
      EXPECT_TRUE(held.service().submit(std::move(job)));
    }
  }
  now_us = 5000;
  held.release();
  done.get_future().wait();
  EXPECT_EQ(queued_us[order[0]], 5000);
  order.resize(16);
  EXPECT_EQ(std::count(order.begin(), order.end(), 7U), 4);
  EXPECT_EQ(std::count(order.begin(), order.end(), 8U), 12);
}

TEST(RenderService, CancelsABackgroundJobForAFrame) {
  std::promise<void> begun;
  std::promise<bool> ended;
  std::promise<void> drawn;
  RenderService service({});
  RenderJob study;
  study.kind = RenderKind::background;
  study.run = [&, cancel = study.cancel](std::int64_t /*queue_us*/) {
    begun.set_value();
    while (!cancel.cancelled()) std::this_thread::yield();
    ended.set_value(true);
  };
  EXPECT_TRUE(service.submit(study));
  begun.get_future().wait();
  RenderJob frame;
  frame.kind = RenderKind::stream;
  frame.run = [&](std::int64_t /*queue_us*/) { drawn.set_value(); };
  EXPECT_TRUE(service.submit(frame));
  EXPECT_TRUE(ended.get_future().get());
  drawn.get_future().wait();
}

// A request is refused while pictures of other addresses run and wait, unless its own cost exceeds
// theirs; waiting for pictures of the same address never causes a refusal.
TEST(RenderService, BoundsTheWaitForOthers) {
  std::atomic<std::int64_t> now_us{0};
  RenderService::Options options;
  options.others_ms_max = 100;
  options.now_us = [&] { return now_us.load(); };
  int refusals = 0;
  options.refused = [&] { ++refusals; };
  std::map<std::string, std::int64_t> charged;
  options.charge = [&](const std::string& payer, std::int64_t us) { charged[payer] += us; };
  std::promise<void> begun;
  std::promise<void> let_go;
  {
    RenderService service(options);
    const auto ask = [&](const char* payer, double cost_ms) {
      RenderJob job;
      job.payer = payer;
      job.cost_ms = cost_ms;
      job.run = [](std::int64_t /*queue_us*/) {};
      return static_cast<bool>(service.submit(std::move(job)));
    };
    RenderJob first;
    first.payer = "a";
    first.cost_ms = 90;
    first.run = [&](std::int64_t /*queue_us*/) {
      begun.set_value();
      let_go.get_future().wait();
      now_us += 40'000;
    };
    EXPECT_TRUE(service.submit(std::move(first)));
    begun.get_future().wait();
    EXPECT_TRUE(ask("b", 90)) << "no other request waits";
    EXPECT_FALSE(ask("c", 90)) << "90 of the running job and 90 of b";
    EXPECT_TRUE(ask("b", 90)) << "its own";
    EXPECT_TRUE(ask("c", 300)) << "a long one";
    EXPECT_FALSE(ask("c", 90));
    now_us = 90'000;
    EXPECT_FALSE(ask("d", 90));
    EXPECT_EQ(refusals, 3);
    let_go.set_value();
  }
  EXPECT_EQ(charged["a"], 40'000 + 90'000);
}

// After refusals the next request is admitted soon: when the running job is nearly done.
TEST(RenderService, UnderOverloadNoJobWaitsForAWholePicture) {
  std::atomic<std::int64_t> now_us{0};
  RenderService::Options options;
  options.others_ms_max = 20;
  options.now_us = [&] { return now_us.load(); };
  std::promise<void> begun;
  std::promise<void> let_go;
  RenderService service(options);
  const auto ask = [&](const std::string& payer) {
    RenderJob job;
    job.payer = payer;
    job.cost_ms = 100;
    job.run = [](std::int64_t /*queue_us*/) {};
    return static_cast<bool>(service.submit(std::move(job)));
  };
  RenderJob first;
  first.cost_ms = 100;
  first.run = [&](std::int64_t /*queue_us*/) {
    begun.set_value();
    let_go.get_future().wait();
  };
  EXPECT_TRUE(service.submit(std::move(first)));
  begun.get_future().wait();
  RenderJob gone;  // cancelled
  gone.cost_ms = 100;
  gone.payer = "w";
  gone.run = [](std::int64_t /*queue_us*/) {};
  EXPECT_TRUE(service.submit(gone)) << "one waits for the running job";
  for (int n = 0; n < 20; ++n) EXPECT_FALSE(ask("p" + std::to_string(n)));
  gone.cancel.cancel();
  EXPECT_FALSE(ask("x")) << "100 ms of the running job";
  now_us = 60'000;
  EXPECT_TRUE(ask("x")) << "40 ms";
  now_us = 5'000'000;
  let_go.set_value();
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
  EXPECT_EQ(queue.requests_before("c", 50).cost_ms, 80) << "one of a, one of b";
  EXPECT_EQ(queue.requests_before("c", 50).count, 2U);
  EXPECT_EQ(queue.requests_before("b", 50).cost_ms, 50);
  EXPECT_EQ(queue.requests_before("a", 50).cost_ms, 30);
  EXPECT_EQ(queue.rest_ms(0), 0);
  (void)queue.pop(1000);
  (void)queue.pop(1000);
  EXPECT_EQ(queue.rest_ms(11'000), 20);
  EXPECT_EQ(queue.rest_ms(99'000), 0);
}

TEST(RenderService, OnePayerMayUseHalfOfTheSlots) {
  RenderService::Options options;
  options.requests_max = 6;
  std::promise<void> begun;
  std::promise<void> let_go;
  RenderService service(options);
  const auto ask = [&](const char* payer) {
    RenderJob job;
    job.payer = payer;
    job.run = [](std::int64_t /*queue_us*/) {};
    return static_cast<bool>(service.submit(std::move(job)));
  };
  RenderJob first;
  first.run = [&](std::int64_t /*queue_us*/) {
    begun.set_value();
    let_go.get_future().wait();
  };
  EXPECT_TRUE(service.submit(std::move(first)));
  begun.get_future().wait();
  for (int n = 0; n < 3; ++n) EXPECT_TRUE(ask("a")) << n;
  EXPECT_FALSE(ask("a"));
  for (int n = 0; n < 3; ++n) EXPECT_TRUE(ask("b")) << n;
  EXPECT_FALSE(ask("c")) << "the limit";
  let_go.set_value();
}

constexpr auto slab = protocol::MethodName::slab;
constexpr auto kernel = protocol::MethodName::kernel;

TEST(RenderCosts, UseTypicalCostsForUnknownOnes) {
  const RenderCosts costs(2);
  EXPECT_DOUBLE_EQ(costs.estimate_ms("a", slab, 1e6), 3) << "6 ns of thread time";
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

// A machine that suspended during a picture must not refuse requests forever.
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
}  // namespace windsplat::net
