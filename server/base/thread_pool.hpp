// A fixed set of workers that run one indexed loop at a time; the caller works too.
#pragma once

#include <cstddef>
#include <memory>

namespace windsplat {

class ThreadPool {
 public:
  // `threads` includes the caller: 1 starts no worker. 0: one per hardware thread.
  // Throws std::system_error if the system cannot create a thread.
  explicit ThreadPool(unsigned threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  [[nodiscard]] unsigned size() const;

  // Calls body(index, worker) once for every index in [0, count), worker in [0, size()), and
  // returns when all calls have returned. Indices are assigned in ascending order. Loops of
  // different callers are serialised; a loop must not start another in the same pool
  // (std::logic_error). The first exception thrown by body is rethrown after every worker has
  // stopped; remaining indices are skipped. Does not allocate.
  //
  // Waiting threads (workers for the next loop, the caller for the last worker) spin for spin_us
  // before they sleep, unless the pool has more threads than the machine.
  template <class Body>
  void run(std::size_t count, const Body& body) {
    run_loop(count, {&body, [](const void* called, std::size_t index, unsigned worker) {
                       (*static_cast<const Body*>(called))(index, worker);
                     }});
  }

  static constexpr int spin_us = 100;

 private:
  // A reference to the body of a loop, which the caller owns.
  struct Loop {
    const void* body = nullptr;
    void (*call)(const void* body, std::size_t index, unsigned worker) = nullptr;
  };
  struct State;

  void run_loop(std::size_t count, Loop loop);

  std::unique_ptr<State> state_;
};

// A pool beside the one that renders: `wanted` threads, at least one, at most four and the
// processors. One if the system permits no more.
std::unique_ptr<ThreadPool> few_threads(std::size_t wanted);

}  // namespace windsplat
