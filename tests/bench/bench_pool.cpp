// Round-trip time of a loop, by the time since the previous loop: the overhead of each loop of a
// frame, before and after the workers fall asleep. `alone`: the body is empty, so that the caller
// may finish before any worker starts. Otherwise every thread has to take part.
//
//   bench_pool [--benchmark_filter=REGEX]
#include <benchmark/benchmark.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <thread>
#include <vector>

#include "server/base/thread_pool.hpp"

namespace {

using Clock = std::chrono::steady_clock;

// Arguments: threads, microseconds of other work by the caller between two loops, alone.
void round_trip(benchmark::State& state) {
  windsplat::ThreadPool pool(static_cast<unsigned>(state.range(0)));
  const std::chrono::microseconds pause(state.range(1));
  const bool alone = state.range(2) != 0;
  std::vector<double> seconds;
  for (auto step : state) {
    static_cast<void>(step);
    const Clock::time_point until = Clock::now() + pause;
    while (Clock::now() < until) continue;
    std::atomic<unsigned> here{0};
    const Clock::time_point start = Clock::now();
    pool.run(pool.size(), [&](std::size_t, unsigned) {
      ++here;
      while (!alone && here < pool.size()) std::this_thread::yield();
    });
    const std::chrono::duration<double> took = Clock::now() - start;
    seconds.push_back(took.count());
    state.SetIterationTime(took.count());
  }
  std::nth_element(seconds.begin(), seconds.begin() + seconds.size() / 2, seconds.end());
  state.counters["median_us"] = 1e6 * seconds[seconds.size() / 2];
}

}  // namespace

BENCHMARK(round_trip)
    ->ArgNames({"threads", "pause_us", "alone"})
    ->ArgsProduct({{2, 4}, {0, 20, 1000}, {0, 1}})
    ->UseManualTime()
    ->Iterations(2000)
    ->Unit(benchmark::kMicrosecond);

BENCHMARK_MAIN();
