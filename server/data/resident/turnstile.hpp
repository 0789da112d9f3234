// Determines the order in which threads read a source.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "server/data/resident/budget.hpp"

namespace windsplat::data {

// One reader at a time; demanded loads precede prefetches.
class Turnstile {
 public:
  void enter(Urgency urgency) {
    std::unique_lock lock(mutex_);
    const bool somebody_waits = urgency != Urgency::prefetch;
    waiting_ += somebody_waits ? 1 : 0;
    free_.wait(lock, [&] { return !taken_ && (somebody_waits || waiting_ == 0); });
    waiting_ -= somebody_waits ? 1 : 0;
    taken_ = true;
  }
  void leave() {
    {
      const std::lock_guard lock(mutex_);
      taken_ = false;
      used_at_ = Clock::now();
    }
    free_.notify_all();
  }
  // Enters unless another reader is inside, waits, or was inside within that time.
  bool enter_if_idle(double idle_s) {
    const std::lock_guard lock(mutex_);
    const std::chrono::duration<double> rest = Clock::now() - used_at_;
    if (taken_ || waiting_ > 0 || rest.count() < idle_s) return false;
    taken_ = true;
    return true;
  }

 private:
  using Clock = std::chrono::steady_clock;

  std::mutex mutex_;
  std::condition_variable free_;
  Clock::time_point used_at_ = Clock::now();
  bool taken_ = false;
  int waiting_ = 0;
};

}  // namespace windsplat::data
