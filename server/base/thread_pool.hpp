// A fixed set of workers that run one indexed loop at a time; the caller works too.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace windsplat {

class ThreadPool {
 public:
  // `threads` counts the caller: 1 means no worker is started. 0 means one a hardware thread.
  // Throws std::system_error if the system has no thread to give.
  explicit ThreadPool(unsigned threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  [[nodiscard]] unsigned size() const;

  // Calls body(index, worker) once for every index in [0, count), worker in [0, size()), and
  // returns when all are done. Indices are handed out in ascending order. Loops of different
  // callers run one after another; a loop must not start another in the same pool
  // (std::logic_error). The first exception thrown by body is rethrown here once every worker has
  // stopped; indices not yet handed out are then left.
  void run(std::size_t count, const std::function<void(std::size_t index, unsigned worker)>& body);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat
