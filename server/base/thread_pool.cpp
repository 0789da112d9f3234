// Workers sleep on a condition variable between loops and draw indices from one atomic counter. A
// loop is open while indices may be left: a worker that wakes too late finds it closed and goes
// back to sleep, so that short loops never wait for threads that did nothing.
#include "server/base/thread_pool.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "server/base/check.hpp"

namespace windsplat {

struct ThreadPool::State {
  std::mutex run_mutex;  // one loop at a time

  std::mutex mutex;  // guards what follows, except for `next`
  std::condition_variable wake;
  std::condition_variable idle;
  std::uint64_t generation = 0;
  bool open = false;
  unsigned running = 0;  // workers inside the loop
  bool stopping = false;
  std::exception_ptr failure;

  // Written before a loop opens, read by those that entered it.
  std::size_t count = 0;
  const std::function<void(std::size_t, unsigned)>* body = nullptr;
  std::atomic<std::size_t> next{0};

  std::vector<std::thread> workers;

  void draw_indices(unsigned worker);
  void work(unsigned worker);
  void stop();
};

namespace {

// The pool whose loop this thread is in: a loop started inside another would wait for itself.
thread_local const void* inside_pool = nullptr;

}  // namespace

void ThreadPool::State::draw_indices(unsigned worker) {
  const void* const outer = std::exchange(inside_pool, this);
  try {
    for (std::size_t i = next.fetch_add(1); i < count; i = next.fetch_add(1)) (*body)(i, worker);
  } catch (...) {
    next.store(count);
    const std::lock_guard lock(mutex);
    if (!failure) failure = std::current_exception();
  }
  inside_pool = outer;
}

void ThreadPool::State::work(unsigned worker) {
  std::uint64_t seen = 0;
  std::unique_lock lock(mutex);
  while (true) {
    wake.wait(lock, [&] { return stopping || (open && generation != seen); });
    if (stopping) return;
    seen = generation;
    ++running;
    lock.unlock();
    draw_indices(worker);
    lock.lock();
    if (--running == 0) idle.notify_one();
  }
}

void ThreadPool::State::stop() {
  {
    const std::lock_guard lock(mutex);
    stopping = true;
  }
  wake.notify_all();
  for (auto& worker : workers) worker.join();
}

ThreadPool::ThreadPool(unsigned threads) : state_(std::make_unique<State>()) {
  if (threads == 0) threads = std::max(1U, std::thread::hardware_concurrency());
  state_->workers.reserve(threads - 1);
  try {
    for (unsigned worker = 1; worker < threads; ++worker) {
      state_->workers.emplace_back([state = state_.get(), worker] { state->work(worker); });
    }
  } catch (...) {  // no thread to be had: those that started must end before their State does
    state_->stop();
    throw;
  }
}

ThreadPool::~ThreadPool() { state_->stop(); }

unsigned ThreadPool::size() const { return static_cast<unsigned>(state_->workers.size()) + 1; }

void ThreadPool::run(std::size_t count, const std::function<void(std::size_t, unsigned)>& body) {
  State& state = *state_;
  WINDSPLAT_CHECK(inside_pool != &state);
  if (count == 0) return;
  const std::lock_guard run_lock(state.run_mutex);
  {
    const std::lock_guard lock(state.mutex);
    state.count = count;
    state.body = &body;
    state.next.store(0);
    state.failure = nullptr;
    state.open = count > 1;  // one index is the caller's: nobody need wake
    ++state.generation;
  }
  if (count > 1) state.wake.notify_all();
  state.draw_indices(0);

  std::exception_ptr failure;
  {
    std::unique_lock lock(state.mutex);
    state.open = false;
    state.idle.wait(lock, [&] { return state.running == 0; });
    failure = std::exchange(state.failure, nullptr);
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace windsplat
