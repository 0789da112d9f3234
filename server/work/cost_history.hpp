// What a picture will probably take, from what those of the same dataset and method did: work
// (cost.hpp) and times in, an estimate out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "protocol/view.hpp"

namespace windsplat::net {

// Thread-safe.
class RenderCosts {
 public:
  // Where nothing is known: a thread's time, within what was measured (docs/user/configuration.md).
  static constexpr double us_a_kernel_unknown = 0.006;
  // Several times what was ever measured. What took longer was kept from the processor, and must
  // not have such pictures refused for good.
  static constexpr double us_a_kernel_max = 0.05;
  static constexpr std::size_t known_max = 256;  // the one not drawn for longest is forgotten

  explicit RenderCosts(unsigned threads) : threads_(threads) {}

  void learn(const std::string& dataset, protocol::MethodName method, double kernels,
             std::int64_t took_us);
  [[nodiscard]] double estimate_ms(const std::string& dataset, protocol::MethodName method,
                                   double kernels) const;

 private:
  using Key = std::pair<std::string, protocol::MethodName>;
  struct Known {
    double us_a_kernel = 0;  // above most of what was seen: views of a dataset differ
    std::uint64_t used = 0;
  };

  const unsigned threads_;
  mutable std::mutex mutex_;
  std::map<Key, Known> known_;
  std::uint64_t uses_ = 0;
};

}  // namespace windsplat::net
