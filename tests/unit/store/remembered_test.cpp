// Numbers derived from a dataset that several threads ask for at once.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <utility>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/data/samples/samples.hpp"

namespace windsplat::data {
namespace {

// Two threads miss at once: one computes, the other waits for its result, or until it is cancelled.
TEST(Remembered, AValueIsComputedByOneThreadForAll) {
  auto source = open_sample("tornado", {4, 4, 4}, 1);
  Dataset dataset(std::move(*source), "tornado", 64U << 20U);
  std::atomic<int> made = 0;
  std::atomic<bool> hold = true;
  const auto ask = [&](Dataset handle) {
    return handle.remembered("a", [&]() -> Result<std::vector<double>> {
      ++made;
      for (int n = 0; hold && n < 2000; ++n) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      return std::vector<double>{4};
    });
  };
  std::thread first([&] { EXPECT_EQ(ask(dataset).value().front(), 4); });
  while (made == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  CancelToken cancel;
  std::atomic<int> ended = 0;
  std::thread second([&] {
    EXPECT_EQ(ask(dataset).value().front(), 4);
    ++ended;
  });
  std::thread third([&] {
    const auto none = ask(dataset.cancelled_by(cancel));
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().kind, ErrorKind::cancelled);
    ++ended;
  });
  // The renderer never waits.
  const auto absent = ask(dataset.resident_only());
  EXPECT_TRUE(!absent && absent.error().kind == ErrorKind::not_resident);
  cancel.cancel();
  third.join();
  EXPECT_EQ(ended, 1);
  hold = false;
  first.join();
  second.join();
  EXPECT_EQ(made, 1);
}

TEST(Remembered, AValueIsComputedAgainByOneThatWaitedForAFailure) {
  auto source = open_sample("tornado", {4, 4, 4}, 1);
  Dataset dataset(std::move(*source), "tornado", 64U << 20U);
  std::atomic<int> made = 0;
  std::atomic<bool> hold = true;
  const auto ask = [&] {
    return dataset.remembered("a", [&]() -> Result<std::vector<double>> {
      if (++made > 1) return std::vector<double>{5};
      for (int n = 0; hold && n < 2000; ++n) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      return make_error(ErrorKind::bad_data, "not now");
    });
  };
  std::thread first([&] { EXPECT_FALSE(ask()); });
  while (made == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::thread second([&] { EXPECT_EQ(ask().value().front(), 5); });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(made, 1);
  hold = false;
  first.join();
  second.join();
  EXPECT_EQ(made, 2);
}

}  // namespace
}  // namespace windsplat::data
