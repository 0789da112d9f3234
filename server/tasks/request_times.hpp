// Estimates the time of a requested picture for admission, before its dataset is read: its work
// (frame/cost.hpp) in, a time that most pictures do not exceed out. Learnt from earlier pictures of
// the same dataset and method.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "protocol/view.hpp"

namespace windsplat::tasks {

// Thread-safe.
class RequestTimes {
 public:
  // Default without history: time of one thread, within the measured range
  // (docs/user/configuration.md).
  static constexpr double us_a_kernel_unknown = 0.006;
  // Several times the largest measured value. Longer times are due to other load of the processor
  // and must not cause such pictures to be refused permanently.
  static constexpr double us_a_kernel_max = 0.05;
  static constexpr std::size_t known_max = 256;  // maximum number of entries; the least recently
                                                 // drawn one is removed

  explicit RequestTimes(unsigned threads) : threads_(threads) {}

  void learn(const std::string& dataset, protocol::MethodName method, double kernels,
             std::int64_t took_us);
  [[nodiscard]] double estimate_ms(const std::string& dataset, protocol::MethodName method,
                                   double kernels) const;

 private:
  using Key = std::pair<std::string, protocol::MethodName>;
  struct Known {
    double us_a_kernel = 0;  // an upper estimate, because views of a dataset differ
    std::uint64_t used = 0;
  };

  const unsigned threads_;
  mutable std::mutex mutex_;
  std::map<Key, Known> known_;
  std::uint64_t uses_ = 0;
};

}  // namespace windsplat::tasks
