// The order of handshakes' steps, and what may go wrong in one.
#include "server/net/handshake_thread.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <future>
#include <stdexcept>
#include <string>
#include <vector>

namespace windsplat::net {
namespace {

// Steps are queued behind one that waits, so that the order is the thread's own choice.
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

TEST(HandshakeThread, addresses_take_turns) {
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

TEST(HandshakeThread, goes_on_after_a_step_that_throws) {
  std::promise<void> done;
  Held held;
  held.thread.submit("a", [] { throw std::runtime_error("no memory"); });
  held.thread.submit("a", [&done] { done.set_value(); });
  held.finish();
  EXPECT_EQ(done.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
}

TEST(HandshakeThread, leaves_the_processor_to_others) {
  int nice = 0;
  Held held;
  held.thread.submit(
      "a", [&nice] { nice = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())); });
  held.finish();
  EXPECT_GT(nice, ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())));
}

TEST(HandshakeThread, drops_what_waits_when_it_ends) {
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
  while (kept.use_count() > 1) std::this_thread::yield();  // dropped while a step is under way
  gate.set_value();
  ending.join();
  thread.submit("a", [kept] { ++*kept; });
  EXPECT_EQ(kept.use_count(), 1);
  EXPECT_EQ(*kept, 0);
}

}  // namespace
}  // namespace windsplat::net
