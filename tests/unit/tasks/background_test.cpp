// Background work that others interrupt is finished nevertheless, and ends at its time.
#include "server/tasks/animation/background.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <future>
#include <thread>
#include <vector>

namespace windsplat::tasks {
namespace {

using std::chrono::milliseconds;
using Clock = BackgroundOwner::Clock;

// Work during which a frame of a stream arrives each time.
struct Interrupted {
  RenderService renderer{RenderService::Options{}};
  std::vector<bool> cut;  // of each attempt
  Clock::time_point begun;
  milliseconds takes{0};

  Result<void> draw(BackgroundOwner& owner, const CancelToken& unwanted = {}) {
    return in_background(renderer, owner, unwanted, [this](const CancelToken& stop) {
      begun = Clock::now();
      RenderJob frame;
      frame.kind = RenderKind::stream;
      frame.owner = 7;
      frame.run = [](std::int64_t /*queue_us*/) {};
      EXPECT_TRUE(renderer.submit(std::move(frame)));
      std::this_thread::sleep_for(takes);
      cut.push_back(stop.cancelled());
      return cut.back() ? Result<void>(make_error(ErrorKind::cancelled, "cut")) : Result<void>();
    });
  }
};

TEST(BackgroundWork, IsNotInterruptedAFourthTime) {
  Interrupted work;
  BackgroundOwner owner{1, "a"};
  ASSERT_TRUE(work.draw(owner));
  EXPECT_EQ(work.cut, (std::vector{true, true, true, false}));
}

TEST(BackgroundWork, LeavesOthersThreeQuartersOfTheTime) {
  Interrupted work;
  work.takes = milliseconds(20);
  BackgroundOwner owner{1, "a"};
  ASSERT_TRUE(work.draw(owner));
  const Clock::time_point first_end = work.begun + work.takes;
  work.cut.clear();
  work.takes = milliseconds(1);  // more attempts than three fit into what follows
  ASSERT_TRUE(work.draw(owner));
  EXPECT_FALSE(work.cut.back());
  EXPECT_GE(work.begun - first_end, 3 * milliseconds(20));
}

// Two clients: one frame is drawn while another waits.
TEST(BackgroundWork, IsDrawnThoughAnotherJobAlwaysWaits) {
  RenderService renderer{RenderService::Options{}};
  std::atomic<bool> is_over{false};
  std::vector<std::thread> clients;
  for (std::uint64_t client = 1; client <= 2; ++client) {
    clients.emplace_back([&, client] {
      while (!is_over) {
        std::promise<void> drawn;
        RenderJob frame;
        frame.kind = RenderKind::stream;
        frame.owner = client;
        frame.run = [&drawn](std::int64_t /*queue_us*/) {
          std::this_thread::sleep_for(milliseconds(20));
          drawn.set_value();
        };
        EXPECT_TRUE(renderer.submit(std::move(frame)));
        drawn.get_future().wait();
      }
    });
  }
  std::this_thread::sleep_for(milliseconds(50));
  BackgroundOwner owner{7, "a"};
  owner.until = Clock::now() + std::chrono::minutes(2);
  for (int piece = 0; piece < 3; ++piece) {
    const auto done =
        in_background(renderer, owner, {}, [](const CancelToken&) { return Result<void>(); });
    EXPECT_TRUE(done) << done.error().message;
  }
  is_over = true;
  for (std::thread& client : clients) client.join();
}

TEST(BackgroundWork, EndsWhenItsTimeIsOver) {
  Interrupted work;
  BackgroundOwner owner{1, "a"};
  owner.insists_from = Clock::now() + std::chrono::hours(1);
  owner.until = Clock::now() + milliseconds(30);
  const auto always_cut = work.draw(owner);
  ASSERT_FALSE(always_cut);
  EXPECT_EQ(always_cut.error().kind, ErrorKind::busy);
  EXPECT_GE(Clock::now(), *owner.until);
}

TEST(BackgroundWork, EndsThoughTheRendererIsNeverIdle) {
  std::promise<void> gate;
  RenderService renderer{RenderService::Options{}};
  RenderJob frame;
  frame.kind = RenderKind::stream;
  frame.run = [&gate](std::int64_t /*queue_us*/) { gate.get_future().wait(); };
  ASSERT_TRUE(renderer.submit(std::move(frame)));
  BackgroundOwner owner{1, "a"};
  owner.until = Clock::now() + milliseconds(30);
  const auto waiting =
      in_background(renderer, owner, {}, [](const CancelToken&) { return Result<void>(); });
  gate.set_value();
  ASSERT_FALSE(waiting);
  EXPECT_EQ(waiting.error().kind, ErrorKind::busy);
}

}  // namespace
}  // namespace windsplat::tasks
