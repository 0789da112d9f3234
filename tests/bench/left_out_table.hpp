// Pairs of frames with and without a feature -> tables of text: costs and savings.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "server/engine/work.hpp"
#include "tests/bench/text_table.hpp"

namespace windsplat::bench {

struct Half {
  std::vector<double> ms;
  engine::WorkReport work;
  double bytes = 0;             // of the heap: all but fields, which are no part of it
  std::optional<double> error;  // measured against the reference; empty: it cannot be
  std::vector<float> rgba;      // linear, premultiplied
};

struct Pair {
  std::string feature;
  std::string method;
  bool alike = false;
  Half with, without;
};

// The array at the end of an NPY file of float32.
inline std::vector<float> npy_values(const std::vector<std::uint8_t>& bytes, int width,
                                     int height) {
  std::vector<float> values(std::size_t{4} * static_cast<std::size_t>(width) *
                            static_cast<std::size_t>(height));
  const std::size_t size = values.size() * sizeof(float);
  std::memcpy(values.data(), bytes.data() + (bytes.size() - size), size);
  return values;
}

inline std::string both(const char* format, double with, double without) {
  std::string text = number(format, with);
  text += " / ";
  text += number(format, without);
  return text;
}

inline std::string counts(std::int64_t with, std::int64_t without) {
  constexpr double million = 1e6;
  return both("%.2f", static_cast<double>(with) / million, static_cast<double>(without) / million);
}

// For example "wind+cloud 15.6 MB".
inline std::string touched(const engine::WorkReport& work) {
  std::string text;
  for (const std::string& field : work.fields) {
    if (!text.empty()) text += "+";
    text += field;
  }
  if (text.empty()) text = "none";
  text += number(" %.1f MB", static_cast<double>(work.bytes) / 1e6);
  return text;
}

// Savings: the median over the rounds of each pair, so that drift cancels.
inline double saved_percent(const Pair& pair) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < pair.with.ms.size(); ++i) {
    ratios.push_back(pair.without.ms[i] / pair.with.ms[i]);
  }
  return 100 * (1 - median(ratios));
}

inline std::string error_text(const Half& half) {
  return half.error ? number("%.2g", *half.error) : "unknown";
}

inline Row cost_row(const Pair& pair) {
  const engine::WorkReport& with = pair.with.work;
  const engine::WorkReport& without = pair.without.work;
  const std::string fields = touched(with);
  const std::string left = touched(without);
  return {pair.feature,
          pair.method,
          number("%.1f", median(pair.with.ms)),
          number("%.1f", median(pair.without.ms)),
          number("%.0f %%", saved_percent(pair)),
          both("%.1f", pair.with.bytes / 1e6, pair.without.bytes / 1e6),
          error_text(pair.with) + " / " + error_text(pair.without),
          counts(with.exponentials, without.exponentials),
          counts(with.pixel_updates, without.pixel_updates),
          fields == left ? fields : fields + " / " + left,
          counts(with.samples, without.samples),
          counts(with.skipped_both, without.skipped_both)};
}

struct Apart {
  double mean = 0, max = 0, rmse = 0;
};

// Mean over pixels of the channel that changes most, which skipped_bound limits.
inline Apart apart(const std::vector<float>& a, const std::vector<float>& b) {
  Apart out;
  const std::size_t pixels = std::min(a.size(), b.size()) / 4;
  for (std::size_t p = 0; p < pixels; ++p) {
    double most = 0;
    for (std::size_t c = 4 * p; c < 4 * p + 4; ++c) {
      const double difference = static_cast<double>(a[c]) - static_cast<double>(b[c]);
      most = std::max(most, std::abs(difference));
      out.rmse += difference * difference;
    }
    out.mean += most;
    out.max = std::max(out.max, most);
  }
  out.mean /= static_cast<double>(pixels);
  out.rmse = std::sqrt(out.rmse / static_cast<double>(4 * pixels));
  return out;
}

inline Row error_row(const Pair& pair) {
  const Apart found = apart(pair.with.rgba, pair.without.rgba);
  return {pair.feature,
          pair.method,
          number("%.2g", pair.without.work.skipped_bound),
          number("%.2g", pair.without.work.stop_bound),
          number("%.2g", found.mean),
          number("%.2g", found.max),
          number("%.2g", found.rmse)};
}

// Costs of each frame, and the difference of pictures that should be equal.
inline std::vector<Table> tables(const std::vector<Pair>& pairs) {
  Table costs{{"omitted", "method", "with, ms", "without, ms", "saved", "memory beside fields, MB",
               "error", "exponentials, M", "pixel updates, M", "fields touched", "samples, M",
               "kernels skipped, M"}};
  Table errors{{"omitted", "method", "mean at most", "stop at most", "mean", "max", "RMSE"}};
  for (const Pair& pair : pairs) {
    if (pair.with.ms.empty()) continue;
    costs.push_back(cost_row(pair));
    if (pair.alike) errors.push_back(error_row(pair));
  }
  return {costs, errors};
}

}  // namespace windsplat::bench
