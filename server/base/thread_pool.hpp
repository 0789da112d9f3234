// A fixed set of workers that run one indexed loop at a time; the caller works too.
#pragma once

#include <cstddef>
#include <memory>

namespace windsplat {

class ThreadPool {
 public:
  // `threads` counts the caller: 1 means no worker is started. 0 means one a hardware thread.
  // Throws std::system_error if the system cannot create a thread.
  explicit ThreadPool(unsigned threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  [[nodiscard]] unsigned size() const;

  // Calls body(index, worker) once for every index in [0, count), worker in [0, size()), and
  // returns when all are done. Indices are handed out in ascending order. Loops of different
  // callers run one after another; a loop must not start another in the same pool
  // (std::logic_error). The first exception thrown by body is rethrown here once every worker has
  // stopped; indices not yet handed out are then left. Nothing is allocated.
  //
  // Whoever waits (a worker for the next loop, the caller for the last worker) looks again and
  // again for spin_us before it sleeps, unless the pool has more threads than the machine.
  template <class Body>
  void run(std::size_t count, const Body& body) {
    run_loop(count, {&body, [](const void* called, std::size_t index, unsigned worker) {
                       (*static_cast<const Body*>(called))(index, worker);
                     }});
  }

  static constexpr int spin_us = 100;

 private:
  // A loop's body wherever the caller keeps it.
  struct Loop {
    const void* body = nullptr;
    void (*call)(const void* body, std::size_t index, unsigned worker) = nullptr;
  };
  struct State;

  void run_loop(std::size_t count, Loop loop);

  std::unique_ptr<State> state_;
};

}  // namespace windsplat
