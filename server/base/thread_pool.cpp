// A loop is a gate that is open while indices may remain. Workers that find it open enter and take
// indices from an atomic counter; late workers find it closed, so that short loops do not wait for
// idle threads. Threads spin briefly, then wait on a condition variable.
#include "server/base/thread_pool.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "server/base/check.hpp"

namespace windsplat {

namespace {

// The bits of the gate: open, pool stopping, number of workers inside, number of the loop.
constexpr std::uint64_t open_bit = 1;
constexpr std::uint64_t stop_bit = 2;
constexpr std::uint64_t one_inside = 4;
constexpr unsigned loop_shift = 32;
constexpr std::uint64_t inside_mask = (std::uint64_t{1} << loop_shift) - one_inside;

std::uint64_t loop_of(std::uint64_t gate) { return gate >> loop_shift; }

// The pool whose loop this thread runs, to detect nested loops, which would deadlock.
thread_local const void* inside_pool = nullptr;

void pause() {
#if defined(__SSE2__)
  _mm_pause();
#endif
}

}  // namespace

struct ThreadPool::State {
  std::mutex run_mutex;  // one loop at a time

  std::atomic<std::uint64_t> gate{0};
  std::atomic<std::size_t> next{0};
  // Written while the gate is closed and empty, read by workers inside.
  std::size_t count = 0;
  Loop loop;

  std::mutex mutex;  // guards sleeping and `failure`
  std::condition_variable wake;
  std::condition_variable idle;
  std::atomic<unsigned> asleep{0};  // workers
  std::atomic<bool> caller_asleep{false};
  std::exception_ptr failure;

  bool spins = false;
  std::vector<std::thread> workers;

  template <class Done>
  bool spin(const Done& done) const;
  bool enter(std::uint64_t& seen);
  void leave();
  void sleep(std::uint64_t seen);
  void wait_for_workers();
  void wake_workers();
  void draw_indices(unsigned worker);
  void work(unsigned worker);
  void stop();
};

// Spins until `done` returns true; false after spin_us.
template <class Done>
bool ThreadPool::State::spin(const Done& done) const {
  using Clock = std::chrono::steady_clock;
  constexpr int polls = 32;  // between reads of the clock
  if (done()) return true;
  if (!spins) return false;
  const Clock::time_point end = Clock::now() + std::chrono::microseconds(spin_us);
  do {
    for (int poll = 0; poll < polls; ++poll) {
      pause();
      if (done()) return true;
    }
  } while (Clock::now() < end);
  return false;
}

bool ThreadPool::State::enter(std::uint64_t& seen) {
  std::uint64_t now = gate.load();
  while ((now & open_bit) != 0 && loop_of(now) != seen) {
    if (!gate.compare_exchange_weak(now, now + one_inside)) continue;
    seen = loop_of(now);
    return true;
  }
  return false;
}

// No lost wake-ups: a thread announces its sleep before it checks the gate again, and a thread that
// changes the gate then checks for sleepers, so at least one of them sees the other.
void ThreadPool::State::leave() {
  const std::uint64_t before = gate.fetch_sub(one_inside);
  if ((before & inside_mask) != one_inside || !caller_asleep.load()) return;
  { const std::lock_guard lock(mutex); }
  idle.notify_one();
}

void ThreadPool::State::wake_workers() {
  if (asleep.load() == 0) return;
  { const std::lock_guard lock(mutex); }
  wake.notify_all();
}

void ThreadPool::State::sleep(std::uint64_t seen) {
  std::unique_lock lock(mutex);
  asleep.fetch_add(1);
  const std::uint64_t now = gate.load();
  const bool due = (now & stop_bit) != 0 || ((now & open_bit) != 0 && loop_of(now) != seen);
  // A worker that wakes too late for a loop spins for the next one.
  if (!due) wake.wait(lock);
  asleep.fetch_sub(1);
}

void ThreadPool::State::wait_for_workers() {
  const auto empty = [this] { return (gate.load() & inside_mask) == 0; };
  if (spin(empty)) return;
  std::unique_lock lock(mutex);
  caller_asleep.store(true);
  idle.wait(lock, empty);
  caller_asleep.store(false);
}

void ThreadPool::State::draw_indices(unsigned worker) {
  const void* const outer = std::exchange(inside_pool, this);
  try {
    for (std::size_t i = next.fetch_add(1); i < count; i = next.fetch_add(1)) {
      loop.call(loop.body, i, worker);
    }
  } catch (...) {
    next.store(count);
    const std::lock_guard lock(mutex);
    if (!failure) failure = std::current_exception();
  }
  inside_pool = outer;
}

void ThreadPool::State::work(unsigned worker) {
  std::uint64_t seen = 0;
  while (true) {
    bool inside = false;
    const bool due = spin([&] {
      inside = enter(seen);
      return inside || (gate.load() & stop_bit) != 0;
    });
    if (inside) {
      draw_indices(worker);
      leave();
    } else if (due) {
      return;
    } else {
      sleep(seen);
    }
  }
}

void ThreadPool::State::stop() {
  gate.fetch_or(stop_bit);
  wake_workers();
  for (auto& worker : workers) worker.join();
}

ThreadPool::ThreadPool(unsigned threads) : state_(std::make_unique<State>()) {
  const unsigned processors = std::max(1U, std::thread::hardware_concurrency());
  if (threads == 0) threads = processors;
  state_->spins = threads <= processors;
  state_->workers.reserve(threads - 1);
  try {
    for (unsigned worker = 1; worker < threads; ++worker) {
      state_->workers.emplace_back([state = state_.get(), worker] { state->work(worker); });
    }
  } catch (...) {  // thread creation failed: join the started threads before State is destroyed
    state_->stop();
    throw;
  }
}

ThreadPool::~ThreadPool() { state_->stop(); }

unsigned ThreadPool::size() const { return static_cast<unsigned>(state_->workers.size()) + 1; }

void ThreadPool::run_loop(std::size_t count, Loop loop) {
  State& state = *state_;
  WINDSPLAT_CHECK(inside_pool != &state);
  if (count == 0) return;
  const std::lock_guard run_lock(state.run_mutex);
  state.count = count;
  state.loop = loop;
  state.next.store(0);
  // The caller runs one index, so a single index needs no worker.
  const bool shared = count > 1 && !state.workers.empty();
  if (shared) {
    // Closed and empty: only the loop number and the open bit change.
    state.gate.fetch_add((std::uint64_t{1} << loop_shift) | open_bit);
    state.wake_workers();
  }
  state.draw_indices(0);
  if (shared) {
    state.gate.fetch_and(~open_bit);
    state.wait_for_workers();
  }
  std::exception_ptr failure;
  {
    const std::lock_guard lock(state.mutex);
    failure = std::exchange(state.failure, nullptr);
  }
  if (failure) std::rethrow_exception(failure);
}

std::unique_ptr<ThreadPool> few_threads(std::size_t wanted) {
  constexpr std::size_t threads_max = 4;
  const auto processors = std::size_t{std::max(1U, std::thread::hardware_concurrency())};
  const std::size_t most = std::min(threads_max, processors);
  try {
    return std::make_unique<ThreadPool>(
        static_cast<unsigned>(std::clamp(wanted, std::size_t{1}, most)));
  } catch (const std::system_error&) {
    return std::make_unique<ThreadPool>(1);
  }
}

}  // namespace windsplat
