// Estimates the time of a requested picture for admission, before its dataset is read: its work
// (frame/cost.hpp) in, a time that most pictures do not exceed out. Learnt from earlier pictures of
// the same dataset and method.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "protocol/view.hpp"
#include "server/frame/frame.hpp"

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

  // Time of encoding pictures in a format, which is in proportion to their pixels.
  void learn_encoding(frame::Format format, double pixels, std::int64_t took_us);
  [[nodiscard]] double encoding_ms(frame::Format format, double pixels) const;

  // Time of describing a view of a dataset (frame/content.hpp).
  static constexpr double describing_ms_unknown = 50;
  void learn_describing(const std::string& dataset, std::int64_t took_us);
  [[nodiscard]] double describing_ms(const std::string& dataset) const;

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
  std::map<std::string, double> describing_ms_;
  // By format: JPEG, PNG, NPY, PDF, SVG. Before any picture: of one thread at 1920x1080; the last
  // two contain a PNG.
  std::array<double, 5> encoding_us_a_pixel_{0.008, 0.05, 0.01, 0.05, 0.05};
};

}  // namespace windsplat::tasks
