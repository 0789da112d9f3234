#include "server/data/resident/remembered.hpp"

#include <chrono>
#include <cstddef>

namespace windsplat::data {

namespace {

constexpr std::size_t keys_max = 256;
constexpr std::chrono::milliseconds poll{10};  // of `cancel`

}  // namespace

Result<std::vector<double>> Remembered::get(const std::string& key, Meeting meeting,
                                            const CancelToken& cancel, const Make& make) {
  auto known = enter(key, meeting, cancel);
  if (!known) return known.error();
  if (*known) return std::move(**known);
  const std::string entered = meeting == Meeting::disregard ? std::string() : key;
  const auto keep = [&](const std::vector<double>& numbers) {
    const std::lock_guard lock(mutex_);
    known_.emplace_back(key, numbers);
    if (known_.size() > keys_max) known_.pop_front();
  };
  // Whatever becomes of it, others stop waiting.
  struct Leave {
    Remembered& of;
    const std::string& key;
    ~Leave() { of.leave(key); }
  };
  const Leave leave{*this, entered};
  auto numbers = make();
  if (numbers) keep(*numbers);
  return numbers;
}

Result<std::optional<std::vector<double>>> Remembered::enter(const std::string& key,
                                                             Meeting meeting,
                                                             const CancelToken& cancel) {
  std::unique_lock lock(mutex_);
  for (;;) {
    for (const auto& [known, numbers] : known_) {
      if (known == key) return std::optional(numbers);
    }
    if (in_progress_.count(key) == 0) break;
    if (meeting == Meeting::leave) {
      return make_error(ErrorKind::not_resident, "a part of the view is not in memory yet");
    }
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "request cancelled");
    changed_.wait_for(lock, poll);
  }
  if (meeting != Meeting::disregard) in_progress_.insert(key);
  return std::optional<std::vector<double>>();
}

void Remembered::leave(const std::string& key) {
  const std::lock_guard lock(mutex_);
  in_progress_.erase(key);
  changed_.notify_all();
}

}  // namespace windsplat::data
