// A flag that one thread raises and the work polls: between tiles, and every few bricks in one.
// Copies share the flag.
#pragma once

#include <atomic>
#include <memory>

namespace windsplat {

class CancelToken {
 public:
  CancelToken() : flag_(std::make_shared<std::atomic<bool>>(false)) {}
  // Copying alone: a token that was moved from would have no flag to ask.
  CancelToken(const CancelToken&) = default;
  CancelToken& operator=(const CancelToken&) = default;
  ~CancelToken() = default;

  void cancel() const { flag_->store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool cancelled() const { return flag_->load(std::memory_order_relaxed); }

 private:
  std::shared_ptr<std::atomic<bool>> flag_;
};

}  // namespace windsplat
