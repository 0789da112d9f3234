// The render thread: refusals, shares of time and charged time. Times are simulated.
#include "server/tasks/render_service.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <map>
#include <string>
#include <thread>
#include <vector>

namespace windsplat::tasks {
namespace {

// A service whose thread is blocked in a job of a stream until release() or its destruction.
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
  RenderService service_;  // last member: its thread uses the above
};

TEST(RenderService, RefusesRequestsAboveItsEstimateOfWaitingWork) {
  HeldService held({16, 10'000, {}});
  EXPECT_TRUE(held.request(60'000)) << "a single request is admitted, whatever its cost";
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
  EXPECT_TRUE(held.request(2'000)) << "a smaller one is admitted";
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

// A request is refused while the picture of another address is drawn and another one waits, unless
// its own cost exceeds the cost before it; waiting for pictures of the same address is no reason
// for a refusal.
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
    EXPECT_FALSE(ask("c", 90)) << "90 of the running one and 90 of b";
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

// Under overload a refused request is soon followed by another, so a request is admitted when the
// running job is nearly done.
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
  EXPECT_TRUE(service.submit(gone)) << "one waits for the running one";
  for (int n = 0; n < 20; ++n) EXPECT_FALSE(ask("p" + std::to_string(n)));
  gone.cancel.cancel();
  EXPECT_FALSE(ask("x")) << "100 ms of the running one";
  now_us = 60'000;
  EXPECT_TRUE(ask("x")) << "40 ms";
  now_us = 5'000'000;
  let_go.set_value();
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
  EXPECT_FALSE(ask("c")) << "this many in total";
  let_go.set_value();
}

}  // namespace
}  // namespace windsplat::tasks
