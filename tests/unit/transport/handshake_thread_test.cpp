// Order of handshake steps, and failures of a step.
#include "server/transport/handshake_thread.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

namespace windsplat::transport {
namespace {

// Steps are queued behind a blocked one, so that the thread alone determines the order.
class Held {
 public:
  Held() {
    thread.submit("0", [gate = gate_.get_future()]() mutable { gate.wait(); });
  }
  void finish() {
    std::promise<void> last;
    thread.submit("zz", [&last] { last.set_value(); });
    gate_.set_value();
    last.get_future().wait();
  }
  HandshakeThread thread;

 private:
  std::promise<void> gate_;
};

TEST(HandshakeThread, AddressesTakeTurns) {
  std::string order;
  Held held;
  for (int n = 0; n < 4; ++n) held.thread.submit("a", [&order] { order += 'a'; });
  for (int n = 0; n < 2; ++n) held.thread.submit("b", [&order] { order += 'b'; });
  held.thread.submit("c", [&order] { order += 'c'; });
  std::promise<void> last;
  for (int n = 0; n < 4; ++n) {
    held.thread.submit("zz", [&, n] {
      if (n == 3) last.set_value();
    });
  }
  held.finish();
  last.get_future().wait();
  EXPECT_EQ(order, "abcabaa");
}

TEST(HandshakeThread, ContinuesAfterAStepThatThrows) {
  std::promise<void> done;
  Held held;
  held.thread.submit("a", [] { throw std::runtime_error("no memory"); });
  held.thread.submit("a", [&done] { done.set_value(); });
  held.finish();
  EXPECT_EQ(done.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
}

TEST(HandshakeThread, YieldsTheProcessorToOthers) {
  int nice = 0;
  Held held;
  held.thread.submit(
      "a", [&nice] { nice = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())); });
  held.finish();
  EXPECT_GT(nice, ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())));
}

TEST(HandshakeThread, ReleasesTheStepsOfAnOwnerAtOnce) {
  const auto kept = std::make_shared<int>(0);
  std::string order;
  const int mine = 0;
  const int other = 0;
  Held held;
  held.thread.submit(
      "a", [&order, kept] { order += '1'; }, &mine);
  held.thread.submit(
      "a", [&order] { order += '2'; }, &other);
  held.thread.submit(
      "b", [&order, kept] { order += '3'; }, &mine);
  EXPECT_EQ(kept.use_count(), 3);
  held.thread.drop("b", &other);
  held.thread.drop("c", &mine);
  EXPECT_EQ(kept.use_count(), 3);
  held.thread.drop("a", &mine);
  EXPECT_EQ(kept.use_count(), 2) << "while the thread is busy";
  held.thread.drop("b", &mine);
  EXPECT_EQ(kept.use_count(), 1);
  held.thread.submit("b", [&order] { order += '4'; });
  held.finish();
  EXPECT_EQ(order, "24");
}

class Task final : public HandshakeTask {
 public:
  explicit Task(HandshakeThread& thread) : HandshakeTask(thread, "a") {}
  void end() { drop(); }
  std::atomic<std::int64_t> steps{0};
  int paid = 0;

 private:
  bool may_go_on() override { return true; }
  void step_took(std::int64_t /*cpu_us*/) override { ++steps; }
  void pay() override { ++paid; }
};

TEST(HandshakeTask, EndedTaskDoesNotWaitForATurn) {
  Held held;
  const auto task = std::make_shared<Task>(held.thread);
  task->submit([] {});
  EXPECT_EQ(task.use_count(), 2) << "the waiting step keeps it alive";
  task->end();
  EXPECT_EQ(task.use_count(), 1);
  const auto kept = std::make_shared<int>(0);
  task->submit([kept] { ++*kept; });
  EXPECT_EQ(kept.use_count(), 1);
  EXPECT_EQ(task->paid, 2);
  held.finish();
  EXPECT_EQ(task->steps, 0);
  EXPECT_EQ(*kept, 0);
}

TEST(HandshakeTask, ReceivesTheTimeOfAStepThatThrew) {
  Held held;
  const auto task = std::make_shared<Task>(held.thread);
  task->submit([] { throw std::runtime_error("no memory"); });
  held.finish();
  EXPECT_EQ(task->steps, 1);
}

TEST(HandshakeThread, DiscardsWaitingStepsAtShutdown) {
  const auto kept = std::make_shared<int>(0);
  std::promise<void> gate;
  std::promise<void> begun;
  HandshakeThread thread;
  thread.submit("a", [&] {
    begun.set_value();
    gate.get_future().wait();
  });
  begun.get_future().wait();
  thread.submit("a", [kept] { ++*kept; });
  std::thread ending([&thread] { thread.stop(); });
  while (kept.use_count() > 1) std::this_thread::yield();  // dropped while a step runs
  gate.set_value();
  ending.join();
  thread.submit("a", [kept] { ++*kept; });
  EXPECT_EQ(kept.use_count(), 1);
  EXPECT_EQ(*kept, 0);
}

}  // namespace
}  // namespace windsplat::transport
