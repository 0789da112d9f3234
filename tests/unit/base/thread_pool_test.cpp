// The pool runs every index once, separates its workers, and survives exceptions.
#include "server/base/thread_pool.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <vector>

namespace windsplat {
namespace {

class EveryPoolSize : public testing::TestWithParam<unsigned> {
 protected:
  ThreadPool pool{GetParam()};
};

TEST_P(EveryPoolSize, RunsEachIndexOnce) {
  EXPECT_EQ(pool.size(), GetParam());
  for (const std::size_t count : {0U, 1U, 2U, 3U, 7U, 1000U}) {
    std::vector<std::atomic<int>> visits(count);
    pool.run(count, [&](std::size_t i, unsigned) { ++visits[i]; });
    for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(visits[i], 1) << i << " of " << count;
  }
}

// A worker number may index scratch memory: no two threads may have the same number at a time.
TEST_P(EveryPoolSize, WorkerNumbersAreSmallAndExclusive) {
  std::vector<std::atomic<int>> holders(GetParam());
  std::atomic<bool> shared = false;
  std::atomic<bool> out_of_range = false;
  pool.run(500, [&](std::size_t, unsigned worker) {
    if (worker >= holders.size()) {
      out_of_range = true;
      return;
    }
    if (++holders[worker] != 1) shared = true;
    std::this_thread::yield();
    --holders[worker];
  });
  EXPECT_FALSE(shared);
  EXPECT_FALSE(out_of_range);
}

// Writes of the body are visible to the caller without further synchronisation, even in consecutive
// loops too short for every worker.
TEST_P(EveryPoolSize, ManyShortLoopsKeepTheirResults) {
  std::vector<std::size_t> plain(5);
  std::size_t sum = 0;
  constexpr std::size_t loops = 20000;
  for (std::size_t loop = 0; loop < loops; ++loop) {
    const std::size_t count = 1 + loop % plain.size();
    pool.run(count, [&](std::size_t i, unsigned) { plain[i] = loop + i; });
    for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(plain[i], loop + i);
    sum += count;
  }
  EXPECT_EQ(sum, 3 * loops);
}

TEST_P(EveryPoolSize, ExceptionReachesTheCallerAndThePoolStaysUsable) {
  for (int round = 0; round < 200; ++round) {
    try {
      pool.run(64, [&](std::size_t i, unsigned) {
        if (i == 17) throw std::runtime_error("seventeen");
      });
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "seventeen");
    }
    std::atomic<int> visits = 0;
    pool.run(64, [&](std::size_t, unsigned) { ++visits; });
    ASSERT_EQ(visits, 64);
  }
}

TEST_P(EveryPoolSize, IndicesStopSoonAfterAnException) {
  std::atomic<std::size_t> visits = 0;
  constexpr std::size_t count = 1U << 20;
  EXPECT_THROW(pool.run(count,
                        [&](std::size_t, unsigned) {
                          ++visits;
                          throw std::runtime_error("first");
                        }),
               std::runtime_error);
  EXPECT_LE(visits, GetParam());  // each thread can have run at most one index
}

TEST_P(EveryPoolSize, NestedLoopIsRefusedInsteadOfDeadlocking) {
  EXPECT_THROW(
      pool.run(4, [&](std::size_t, unsigned) { pool.run(2, [](std::size_t, unsigned) {}); }),
      std::logic_error);
  std::atomic<int> visits = 0;
  pool.run(4, [&](std::size_t, unsigned) { ++visits; });
  EXPECT_EQ(visits, 4);
}

TEST_P(EveryPoolSize, LoopInAnotherPoolIsAllowed) {
  ThreadPool inner(2);
  std::atomic<int> visits = 0;
  pool.run(3,
           [&](std::size_t, unsigned) { inner.run(5, [&](std::size_t, unsigned) { ++visits; }); });
  EXPECT_EQ(visits, 15);
}

TEST_P(EveryPoolSize, LoopsOfSeveralCallersDoNotInterfere) {
  constexpr int callers = 4;
  std::vector<std::vector<int>> visits(callers, std::vector<int>(97));
  std::vector<std::atomic<int>> inside(callers);
  std::atomic<bool> overlapped = false;
  std::vector<std::thread> threads;
  threads.reserve(callers);
  for (int caller = 0; caller < callers; ++caller) {
    threads.emplace_back([&, caller] {
      for (int loop = 0; loop < 50; ++loop) {
        pool.run(97, [&](std::size_t i, unsigned) {
          ++inside[caller];
          for (int other = 0; other < callers; ++other) {
            if (other != caller && inside[other] != 0) overlapped = true;
          }
          ++visits[caller][i];
          --inside[caller];
        });
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_FALSE(overlapped);
  for (const auto& counts : visits) {
    for (const int count : counts) ASSERT_EQ(count, 50);
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, EveryPoolSize, testing::Values(1U, 2U, 3U, 8U));

TEST(ThreadPool, OneThreadRunsInTheCallerInAscendingOrder) {
  ThreadPool pool(1);
  const auto caller = std::this_thread::get_id();
  std::vector<std::size_t> order;
  pool.run(50, [&](std::size_t i, unsigned worker) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    EXPECT_EQ(worker, 0U);
    order.push_back(i);
  });
  std::vector<std::size_t> ascending(50);
  std::iota(ascending.begin(), ascending.end(), 0U);
  EXPECT_EQ(order, ascending);
}

TEST(ThreadPool, ZeroMeansOneThreadPerHardwareThread) {
  EXPECT_EQ(ThreadPool(0).size(), std::max(1U, std::thread::hardware_concurrency()));
}

// Two indices that wait for each other end only if two threads run concurrently.
TEST(ThreadPool, WorkersRunConcurrently) {
  ThreadPool pool(2);
  std::atomic<int> arrived = 0;
  pool.run(2, [&](std::size_t, unsigned) {
    ++arrived;
    while (arrived < 2) std::this_thread::yield();
  });
  EXPECT_EQ(arrived, 2);
}

TEST(ThreadPool, UnusedPoolIsDestroyed) {
  for (int i = 0; i < 100; ++i) EXPECT_EQ(ThreadPool(4).size(), 4U);
}

}  // namespace
}  // namespace windsplat
