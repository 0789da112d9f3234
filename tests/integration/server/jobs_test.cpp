// Jobs: states, limits, cancellation; an error of the work fails only its job.
#include "server/tasks/jobs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>

namespace windsplat::tasks {
namespace {

using testing::ElementsAre;

// Blocks jobs until it is opened.
class Gate {
 public:
  void open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }
  void pass() {
    std::unique_lock lock(mutex_);
    ++inside_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return open_; });
    --inside_;
  }
  void wait_for_inside(int count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return inside_ >= count; });
  }
  int inside() {
    const std::lock_guard lock(mutex_);
    return inside_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
  int inside_ = 0;
};

std::string submitted(Jobs& jobs, Jobs::Work work) {
  const auto job = jobs.submit("dataset", std::move(work));
  EXPECT_TRUE(job);
  return job ? job->id : "";
}

protocol::JobDescription finished(const Jobs& jobs, const std::string& id) {
  while (true) {
    const auto job = jobs.find(id);
    if (!job || (job->state != "queued" && job->state != "running")) {
      EXPECT_TRUE(job) << id;
      return job ? *job : protocol::JobDescription{};
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

TEST(Jobs, ResultErrorAndExceptionEachEndTheirJobOnly) {
  Jobs jobs({"jobs", 2, 8});
  const auto good = submitted(jobs, [](const Jobs::Handle&) { return Result<std::string>("gcm"); });
  const auto bad = submitted(jobs, [](const Jobs::Handle&) -> Result<std::string> {
    return make_error(ErrorKind::bad_data, "not a supported file");
  });
  const auto thrown = submitted(jobs, [](const Jobs::Handle&) -> Result<std::string> {
    throw std::runtime_error("at somebody/source.cpp:7");
  });
  const auto hungry =
      submitted(jobs, [](const Jobs::Handle&) -> Result<std::string> { throw std::bad_alloc(); });
  const auto done = finished(jobs, good);
  EXPECT_EQ(done.state, "done");
  EXPECT_EQ(done.progress, 1);
  EXPECT_EQ(done.result, protocol::JobResult("gcm"));
  EXPECT_FALSE(done.problem);
  const auto failed = finished(jobs, bad);
  EXPECT_EQ(failed.state, "failed");
  ASSERT_TRUE(failed.problem);
  EXPECT_EQ(failed.problem->status, 422);
  EXPECT_EQ(failed.problem->detail, "not a supported file");
  EXPECT_FALSE(failed.result);
  EXPECT_EQ(finished(jobs, thrown).problem->status, 500);
  EXPECT_THAT(finished(jobs, thrown).problem->detail,
              testing::Not(testing::HasSubstr("source.cpp")));
  EXPECT_EQ(finished(jobs, hungry).problem->status, 507);
  EXPECT_FALSE(jobs.find("99"));
  EXPECT_FALSE(jobs.cancel("99"));
}

TEST(Jobs, ConcurrencyIsLimitedAndOthersWait) {
  Gate gate;
  Jobs jobs({"jobs", 2, 8});
  std::vector<std::string> ids;
  for (int i = 0; i < 5; ++i) {
    ids.push_back(submitted(jobs, [&](const Jobs::Handle& handle) {
      handle.report_progress(0.5);
      gate.pass();
      return Result<std::string>("x");
    }));
  }
  gate.wait_for_inside(2);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(gate.inside(), 2);
  std::vector<std::string> states;
  for (const auto& job : jobs.list()) states.push_back(job.state);
  EXPECT_THAT(states, ElementsAre("running", "running", "queued", "queued", "queued"));
  EXPECT_EQ(jobs.find(ids[0])->progress, 0.5);
  const double eta_ms = jobs.find(ids[0])->eta_ms.value_or(-1);
  EXPECT_GE(eta_ms, 0);
  EXPECT_EQ(eta_ms, std::floor(eta_ms)) << "whole milliseconds";
  EXPECT_FALSE(jobs.find(ids[4])->eta_ms);
  gate.open();
  for (const auto& id : ids) EXPECT_EQ(finished(jobs, id).state, "done");
}

TEST(Jobs, SlowJobsLeaveAThreadToOthers) {
  Gate gate;
  Jobs jobs({"jobs", 2, 8});
  const auto pass = [&](const Jobs::Handle&) {
    gate.pass();
    return Result<protocol::JobResult>("x");
  };
  Jobs::Terms slow;
  slow.slow = true;
  std::vector<std::string> ids;
  for (int i = 0; i < 3; ++i) ids.push_back(jobs.submit("reference", pass, slow)->id);
  gate.wait_for_inside(1);
  ids.push_back(submitted(jobs, pass));
  gate.wait_for_inside(2);
  std::vector<std::string> states;
  for (const auto& job : jobs.list()) states.push_back(job.state);
  EXPECT_THAT(states, ElementsAre("running", "queued", "queued", "running"));
  gate.open();
  for (const auto& id : ids) EXPECT_EQ(finished(jobs, id).state, "done");
}

TEST(Jobs, SlowJobsOfOneKindLeaveAThreadToThoseOfAnotherAndToOthers) {
  Gate gate;
  Jobs jobs(windsplat::tasks::job_settings);
  const auto pass = [&](const Jobs::Handle&) {
    gate.pass();
    return Result<protocol::JobResult>("x");
  };
  Jobs::Terms slow;
  slow.slow = true;
  std::vector<std::string> ids;
  for (const char* kind : {"animation", "animation", "reference", "reference"}) {
    ids.push_back(jobs.submit(kind, pass, slow)->id);
  }
  gate.wait_for_inside(2);
  ids.push_back(submitted(jobs, pass));
  gate.wait_for_inside(3);
  std::vector<std::string> states;
  for (const auto& job : jobs.list()) states.push_back(job.state);
  EXPECT_THAT(states, ElementsAre("running", "queued", "running", "queued", "running"));
  gate.open();
  for (const auto& id : ids) EXPECT_EQ(finished(jobs, id).state, "done");
}

TEST(Jobs, WaitingAndRunningJobsCanBeCancelled) {
  Gate gate;
  Jobs jobs({"jobs", 1, 8});
  std::atomic<bool> second_ran{false};
  const auto running = submitted(jobs, [&](const Jobs::Handle& handle) -> Result<std::string> {
    gate.pass();
    if (handle.cancel.cancelled()) return make_error(ErrorKind::cancelled, "unwanted");
    return std::string("x");
  });
  gate.wait_for_inside(1);
  const auto waiting = submitted(jobs, [&](const Jobs::Handle&) {
    second_ran = true;
    return Result<std::string>("x");
  });
  EXPECT_TRUE(jobs.cancel(waiting));
  EXPECT_EQ(jobs.find(waiting)->state, "cancelled");
  EXPECT_TRUE(jobs.cancel(running));
  EXPECT_EQ(jobs.find(running)->state, "running") << "until it checks for cancellation";
  gate.open();
  EXPECT_EQ(finished(jobs, running).state, "cancelled");
  EXPECT_FALSE(finished(jobs, running).problem);
  const auto last = submitted(jobs, [](const Jobs::Handle&) { return Result<std::string>("x"); });
  EXPECT_EQ(finished(jobs, last).state, "done");
  EXPECT_TRUE(jobs.cancel(last));
  EXPECT_EQ(jobs.find(last)->state, "done") << "a finished job is unchanged";
  EXPECT_FALSE(second_ran);
}

TEST(Jobs, CancelledSlowJobLeavesTheQueueWithoutRunning) {
  Gate gate;
  Jobs jobs({"jobs", 2, 8});
  std::atomic<bool> cancelled_ran{false};
  const auto pass = [&](const Jobs::Handle&) {
    gate.pass();
    return Result<protocol::JobResult>("x");
  };
  const auto at_once = [](const Jobs::Handle&) { return Result<protocol::JobResult>("x"); };
  // A token of its own for each job.
  const auto slow = [] { return Jobs::Terms{CancelToken(), true}; };
  const auto first = jobs.submit("reference", pass, slow())->id;
  gate.wait_for_inside(1);
  const auto second = jobs.submit(
                              "reference",
                              [&](const Jobs::Handle&) {
                                cancelled_ran = true;
                                return Result<protocol::JobResult>("x");
                              },
                              slow())
                          ->id;
  EXPECT_TRUE(jobs.cancel(second));
  EXPECT_EQ(finished(jobs, submitted(jobs, at_once)).state, "done");
  EXPECT_EQ(jobs.find(first)->state, "running");
  const auto third = jobs.submit("reference", at_once, slow())->id;
  EXPECT_EQ(finished(jobs, submitted(jobs, at_once)).state, "done");
  EXPECT_EQ(jobs.find(third)->state, "queued") << "slow jobs run one at a time";
  gate.open();
  EXPECT_EQ(finished(jobs, third).state, "done");
  EXPECT_EQ(jobs.find(second)->state, "cancelled");
  EXPECT_FALSE(cancelled_ran);
}

TEST(Jobs, CancelledJobsAreListedUntilTheyLeaveTheQueue) {
  Gate gate;
  Jobs jobs({"jobs", 1, 3});
  const auto pass = [&](const Jobs::Handle&) {
    gate.pass();
    return Result<protocol::JobResult>("x");
  };
  const auto running = submitted(jobs, pass);
  gate.wait_for_inside(1);
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(jobs.cancel(submitted(jobs, pass)));
  const auto refused = jobs.submit("test", pass);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::busy);
  gate.open();
  EXPECT_EQ(finished(jobs, running).state, "done");
}

TEST(Jobs, OldestFinishedJobIsForgottenUnfinishedOnesAreKept) {
  Gate gate;
  Jobs jobs({"jobs", 1, 3});
  const auto pass = [&](const Jobs::Handle&) {
    gate.pass();
    return Result<std::string>("x");
  };
  const auto first = submitted(jobs, pass);
  submitted(jobs, pass);
  submitted(jobs, pass);
  const auto refused = jobs.submit("dataset", pass);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::busy);
  gate.open();
  finished(jobs, first);
  const auto fourth = submitted(jobs, pass);
  EXPECT_FALSE(jobs.find(first));
  EXPECT_EQ(jobs.list().size(), 3U);
  EXPECT_EQ(finished(jobs, fourth).state, "done");
}

TEST(Jobs, ShutdownCancelsRunningAndWaitingJobs) {
  std::atomic<int> ran{0};
  {
    Jobs jobs({"jobs", 1, 8});
    Gate started;
    started.open();
    for (int i = 0; i < 3; ++i) {
      submitted(jobs, [&](const Jobs::Handle& handle) -> Result<std::string> {
        ++ran;
        while (!handle.cancel.cancelled()) std::this_thread::yield();
        return make_error(ErrorKind::cancelled, "");
      });
    }
    while (ran == 0) std::this_thread::yield();
  }
  EXPECT_EQ(ran, 1);
}

}  // namespace
}  // namespace windsplat::tasks
