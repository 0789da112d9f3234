// Volume -> histogram and range, by passes over the samples with counters as the only memory.
#include "server/data/model/measure.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>

#include "server/base/check.hpp"

namespace windsplat::data {

namespace {

constexpr std::size_t samples_between_polls = std::size_t{1} << 20;

// Calls `visit` with the value of every unmasked sample; false if cancelled.
template <class Visit>
bool visit_values(const Volume& volume, const CancelToken& cancel, Visit visit) {
  std::array<const float*, 3> component{};
  for (int c = 0; c < volume.components; ++c) {
    component[static_cast<std::size_t>(c)] = volume.component(c);
  }
  const std::size_t samples = volume.samples();
  for (std::size_t from = 0; from < samples; from += samples_between_polls) {
    if (cancel.cancelled()) return false;
    const std::size_t to = std::min(samples, from + samples_between_polls);
    for (std::size_t i = from; i < to; ++i) {
      if (std::isnan(component[0][i])) continue;
      visit(volume.components == 1 ? component[0][i]
                                   : magnitude(component.data(), volume.components, i));
    }
  }
  return true;
}

Error request_cancelled() { return make_error(ErrorKind::cancelled, "request cancelled"); }

// Converts floats to integers of the same order, and back.
std::uint32_t order_of(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  return (bits & 0x80000000U) != 0 ? ~bits : bits | 0x80000000U;
}
float with_order(std::uint32_t order) {
  return std::bit_cast<float>((order & 0x80000000U) != 0 ? order & 0x7fffffffU : ~order);
}

using Counts = std::vector<std::int64_t>;  // counts by the upper or the lower half of the bits

// The counter that contains the value of a rank; changes the rank to that within the counter.
std::uint32_t counter_of(const Counts& counts, std::int64_t& rank) {
  std::uint32_t at = 0;
  while (at + 1 < counts.size() && rank >= counts[at]) rank -= counts[at++];
  return at;
}

// The least and greatest values after the given share is trimmed at both ends. Exact: counts upper
// halves of the bits, then lower halves for the two counters concerned.
Result<std::optional<std::array<double, 2>>> clipped_range(const Volume& volume,
                                                           const HistogramRequest& request,
                                                           const CancelToken& cancel) {
  constexpr std::size_t halves = std::size_t{1} << 16;
  const auto wanted = [&](float value) { return !request.logarithmic || value > 0; };
  Counts upper(halves);
  std::int64_t total = 0;
  bool done = visit_values(volume, cancel, [&](float value) {
    if (!wanted(value)) return;
    ++upper[order_of(value) >> 16];
    ++total;
  });
  if (!done) return request_cancelled();
  if (total == 0) return std::optional<std::array<double, 2>>();
  const auto dropped = std::min(
      (total - 1) / 2, static_cast<std::int64_t>(request.clip * static_cast<double>(total)));
  std::array<std::int64_t, 2> rank{dropped, total - 1 - dropped};
  const std::array<std::uint32_t, 2> half{counter_of(upper, rank[0]), counter_of(upper, rank[1])};
  std::array<Counts, 2> lower{Counts(halves), Counts(halves)};
  done = visit_values(volume, cancel, [&](float value) {
    if (!wanted(value)) return;
    const std::uint32_t order = order_of(value);
    for (std::size_t end = 0; end < 2; ++end) {
      if (order >> 16 == half[end]) ++lower[end][order & 0xffffU];
    }
  });
  if (!done) return request_cancelled();
  std::array<double, 2> range{};
  for (std::size_t end = 0; end < 2; ++end) {
    range[end] =
        static_cast<double>(with_order(half[end] << 16 | counter_of(lower[end], rank[end])));
  }
  return std::optional(range);
}

Result<std::optional<std::array<double, 2>>> range_of(const Volume& volume,
                                                      const HistogramRequest& request,
                                                      const CancelToken& cancel) {
  if (request.range) {
    const auto [low, high] = *request.range;
    if (!std::isfinite(low) || !std::isfinite(high) || low >= high) {
      return make_error(ErrorKind::invalid, "the range of a histogram must ascend");
    }
    if (request.logarithmic && low <= 0) {
      return make_error(ErrorKind::invalid, "the range of logarithmic bins must begin above 0");
    }
    return request.range;
  }
  if (request.clip > 0 || request.logarithmic) return clipped_range(volume, request, cancel);
  if (volume.masked >= static_cast<std::int64_t>(volume.samples())) {
    return std::optional<std::array<double, 2>>();
  }
  return std::optional(
      std::array{static_cast<double>(volume.range[0]), static_cast<double>(volume.range[1])});
}

std::vector<double> edges_of(const std::array<double, 2>& range, int bins, bool logarithmic) {
  std::vector<double> edges;
  for (int i = 0; i <= bins; ++i) {
    const double share = static_cast<double>(i) / bins;
    // Not by the difference, which may exceed the range of double.
    edges.push_back(logarithmic
                        ? std::exp((1 - share) * std::log(range[0]) + share * std::log(range[1]))
                        : (1 - share) * range[0] + share * range[1]);
  }
  edges.front() = range[0];
  edges.back() = range[1];
  return edges;
}

// Finds bins by arithmetic, then corrects by the bin edges where rounding would differ.
class Binning {
 public:
  Binning(const std::vector<double>& edges, bool logarithmic)
      : edges_(edges),
        logarithmic_(logarithmic),
        low_(position(edges.front())),
        per_bin_(static_cast<double>(edges.size() - 1) / (position(edges.back()) - low_)) {}

  [[nodiscard]] std::size_t bin(double value) const {
    const auto last = static_cast<double>(edges_.size() - 2);
    const double near = (position(value) - low_) * per_bin_;
    // For a range of width zero, 0 / 0 is NaN, for which all comparisons are false.
    auto at = near > 0 ? static_cast<std::size_t>(std::min(near, last)) : 0;
    while (at > 0 && value < edges_[at]) --at;
    while (at + 2 < edges_.size() && value >= edges_[at + 1] && edges_[at + 1] < edges_.back()) {
      ++at;
    }
    return at;
  }

 private:
  // Halved first: the difference of two finite doubles may be infinite, that of their halves is
  // not.
  [[nodiscard]] double position(double value) const {
    return logarithmic_ ? std::log(value) : value / 2;
  }

  const std::vector<double>& edges_;
  bool logarithmic_;
  double low_;
  double per_bin_;
};

}  // namespace

Result<Histogram> histogram(const Volume& volume, const HistogramRequest& request,
                            const CancelToken& cancel) {
  WINDSPLAT_CHECK(request.bins >= 1 && request.clip >= 0 && request.clip < 0.5);
  const auto range = range_of(volume, request, cancel);
  if (!range) return range.error();
  Histogram out;
  out.range = *range;
  out.masked = volume.masked;
  out.counts.assign(static_cast<std::size_t>(request.bins), 0);
  if (!out.range) {
    // Logarithmic bins without positive values.
    out.below = static_cast<std::int64_t>(volume.samples()) - volume.masked;
    return out;
  }
  out.edges = edges_of(*out.range, request.bins, request.logarithmic);
  const Binning binning(out.edges, request.logarithmic);
  const auto [low, high] = *out.range;
  const bool done = visit_values(volume, cancel, [&, low = low, high = high](float raw) {
    const auto value = static_cast<double>(raw);
    if (value < low) {
      ++out.below;
    } else if (value > high) {
      ++out.above;
    } else {
      ++out.counts[binning.bin(value)];
    }
  });
  if (!done) return request_cancelled();
  return out;
}

std::optional<std::vector<double>> value_at(const Volume& volume, const std::array<int, 3>& index) {
  for (std::size_t a = 0; a < 3; ++a) {
    WINDSPLAT_CHECK(index[a] >= 0 && index[a] < volume.dims[a]);
  }
  const std::size_t row =
      static_cast<std::size_t>(index[2]) * static_cast<std::size_t>(volume.dims[1]) +
      static_cast<std::size_t>(index[1]);
  const std::size_t i =
      row * static_cast<std::size_t>(volume.dims[0]) + static_cast<std::size_t>(index[0]);
  std::vector<double> out;
  for (int c = 0; c < volume.components; ++c) {
    const auto value = static_cast<double>(volume.component(c)[i]);
    if (std::isnan(value)) return std::nullopt;
    out.push_back(value);
  }
  return out;
}

void FieldRange::add(const Volume& volume) {
  add(StoredRange{volume.range, volume.masked}, volume.samples());
}

void FieldRange::add(const StoredRange& stored, std::size_t samples) {
  masked += stored.masked;
  if (stored.masked >= static_cast<std::int64_t>(samples)) return;
  const std::array added{static_cast<double>(stored.range[0]),
                         static_cast<double>(stored.range[1])};
  range =
      range ? std::array{std::min((*range)[0], added[0]), std::max((*range)[1], added[1])} : added;
}

std::optional<Extremes> extremes(const Volume& volume) {
  std::optional<std::array<std::size_t, 2>> at;
  std::array<double, 2> found{};  // squares of magnitudes
  for (std::size_t n = 0; n < volume.samples(); ++n) {
    double value = volume.component(0)[n];
    if (volume.components > 1) value *= value;
    for (int c = 1; c < volume.components; ++c) {
      const double part = volume.component(c)[n];
      value += part * part;
    }
    if (std::isnan(value)) continue;
    if (!at) {
      at = {n, n};
      found = {value, value};
    } else if (value < found[0]) {
      (*at)[0] = n;
      found[0] = value;
    } else if (value > found[1]) {
      (*at)[1] = n;
      found[1] = value;
    }
  }
  if (!at) return std::nullopt;
  const auto index = [&](std::size_t n) {
    const auto x = static_cast<std::size_t>(volume.dims[0]);
    const auto y = static_cast<std::size_t>(volume.dims[1]);
    return std::array<int, 3>{static_cast<int>(n % x), static_cast<int>(n / x % y),
                              static_cast<int>(n / x / y)};
  };
  return Extremes{index((*at)[0]), index((*at)[1])};
}

}  // namespace windsplat::data
