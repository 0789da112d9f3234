#include "tests/bench/direction/tally.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "server/base/pcg3d.hpp"

namespace windsplat::bench {
namespace {

// Percentile bootstrap [Efron and Tibshirani, An Introduction to the Bootstrap, section 13.3].
Estimate resampled(const std::vector<double>& values) {
  if (values.empty()) return {std::nan(""), std::nan(""), std::nan("")};
  constexpr std::uint32_t samples = 4000;
  const auto n = static_cast<std::uint32_t>(values.size());
  std::vector<double> means;
  for (std::uint32_t sample = 0; sample < samples; ++sample) {
    double sum = 0;
    for (std::uint32_t k = 0; k < n; ++k) sum += values[pcg3d({sample, k, n})[0] % n];
    means.push_back(sum / n);
  }
  std::sort(means.begin(), means.end());
  double sum = 0;
  for (const double value : values) sum += value;
  return {sum / n, means[samples / 40], means[samples - 1 - samples / 40]};
}

}  // namespace

Estimate mean_of(const Shares& shares) {
  std::vector<double> values;
  for (const auto& [field, share] : shares) {
    if (share.count > 0) values.push_back(share.sum / share.count);
  }
  return resampled(values);
}

Estimate difference_of(const Shares& one, const Shares& other) {
  std::vector<double> values;
  for (const auto& [field, share] : one) {
    const auto at = other.find(field);
    if (at == other.end() || share.count == 0 || at->second.count == 0) continue;
    values.push_back(share.sum / share.count - at->second.sum / at->second.count);
  }
  return resampled(values);
}

}  // namespace windsplat::bench
