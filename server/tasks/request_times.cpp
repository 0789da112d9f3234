// Tracks microseconds per kernel for each dataset and method; rises fast, falls slowly.
#include "server/tasks/request_times.hpp"

#include <algorithm>

namespace windsplat::tasks {

namespace {

// With upward steps five times the downward ones, about five of six samples are below the level.
constexpr double weight_above = 0.5;
constexpr double weight_below = 0.1;

}  // namespace

void RequestTimes::learn(const std::string& dataset, protocol::MethodName method, double kernels,
                         std::int64_t took_us) {
  if (kernels <= 0) return;
  const double seen = std::min(static_cast<double>(took_us) / kernels, us_a_kernel_max);
  const std::lock_guard lock(mutex_);
  const auto [at, is_new] = known_.try_emplace({dataset, method}, Known{seen, 0});
  Known& known = at->second;
  const double weight = seen > known.us_a_kernel ? weight_above : weight_below;
  known.us_a_kernel += weight * (seen - known.us_a_kernel);
  known.used = ++uses_;
  if (known_.size() <= known_max) return;
  known_.erase(std::min_element(known_.begin(), known_.end(), [](const auto& a, const auto& b) {
    return a.second.used < b.second.used;
  }));
}

double RequestTimes::estimate_ms(const std::string& dataset, protocol::MethodName method,
                                 double kernels) const {
  const std::lock_guard lock(mutex_);
  const auto known = known_.find({dataset, method});
  const double us_a_kernel =
      known == known_.end() ? us_a_kernel_unknown / threads_ : known->second.us_a_kernel;
  return us_a_kernel * kernels / 1000;
}

void RequestTimes::learn_encoding(frame::Format format, double pixels, std::int64_t took_us) {
  if (pixels <= 0) return;
  const std::lock_guard lock(mutex_);
  double& known = encoding_us_a_pixel_.at(static_cast<std::size_t>(format));
  const double seen = static_cast<double>(took_us) / pixels;
  known += (seen > known ? weight_above : weight_below) * (seen - known);
}

double RequestTimes::encoding_ms(frame::Format format, double pixels) const {
  const std::lock_guard lock(mutex_);
  return encoding_us_a_pixel_.at(static_cast<std::size_t>(format)) * pixels / 1000;
}

void RequestTimes::learn_describing(const std::string& dataset, std::int64_t took_us) {
  const double seen = static_cast<double>(took_us) / 1000;
  const std::lock_guard lock(mutex_);
  if (describing_ms_.size() >= known_max && !describing_ms_.contains(dataset)) {
    describing_ms_.clear();  // the next views tell it again
  }
  const auto [at, is_new] = describing_ms_.try_emplace(dataset, seen);
  at->second += (seen > at->second ? weight_above : weight_below) * (seen - at->second);
}

double RequestTimes::describing_ms(const std::string& dataset) const {
  const std::lock_guard lock(mutex_);
  const auto known = describing_ms_.find(dataset);
  return known == describing_ms_.end() ? describing_ms_unknown : known->second;
}

}  // namespace windsplat::tasks
