// Nearby measurements -> forecasts, in logarithms.
#include "server/quality/table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "server/quality/laws.hpp"

namespace windsplat::quality {
namespace {

constexpr double ms_least = 1e-3;
constexpr double near = 0.5;  // distance below which a calibration run adds no information
constexpr std::size_t nearest_max = 6;

// Linear RMSE of a JPEG of quality 90, the median of the samples (docs/benchmarks/error.md).
constexpr double encoding_error_of_lines = 9.5e-3;
constexpr double encoding_error_of_media = 2.4e-3;
// Additional error of chroma subsampling, independent of quality.
constexpr double half_chroma = 0.95;

// Quantisation error relative to that at quality 90. Quantisation steps follow libjpeg: 50 / q
// below 50, 2 - q / 50 above. The error saturates once most detail is lost.
double relative_quantisation_error(int quality) {
  const auto lost = [](double q) {
    constexpr double saturation = 0.36;
    const double step = q >= 50 ? 2.02 - q / 50 : 50 / std::max(q, 1.0);
    return step / (step + saturation);
  };
  return lost(quality) / lost(90);
}

// The logarithm of a measured over an expected value.
struct Observation {
  const Viewpoint* viewpoint = nullptr;
  double log_ratio = 0;
  double apart = 0;  // distance from the requested viewpoint
};

struct Kriged {
  double log_ratio = 0;
  double variance = 0;  // noise of a new measurement
};

double squared(double x) { return x * x; }

// C = signature^2 + viewpoint^2 exp(-distance) + noise^2 [same measurement]; the mean is 0. Solves
// C w = c by Cholesky factorisation, with the forward substitution of c row by row.
Kriged krige(const std::vector<Observation>& observations, const Scatter& scatter) {
  const double of_signature = squared(scatter.signature);
  const double of_viewpoint = squared(scatter.viewpoint);
  std::array<std::array<double, nearest_max>, nearest_max> factor{};
  std::array<double, nearest_max> asked{};
  std::array<double, nearest_max> known{};
  Kriged out;
  out.variance = of_signature + of_viewpoint + squared(scatter.noise);
  for (std::size_t i = 0; i < observations.size(); ++i) {
    asked[i] = of_signature + of_viewpoint * std::exp(-observations[i].apart);
    known[i] = observations[i].log_ratio;
    for (std::size_t j = 0; j <= i; ++j) {
      double c = of_signature + of_viewpoint * std::exp(-distance(*observations[i].viewpoint,
                                                                  *observations[j].viewpoint));
      if (i == j) c += squared(scatter.noise);
      for (std::size_t k = 0; k < j; ++k) c -= factor[i][k] * factor[j][k];
      factor[i][j] = i == j ? std::sqrt(c) : c / factor[j][j];
    }
    for (std::size_t k = 0; k < i; ++k) {
      asked[i] -= factor[i][k] * asked[k];
      known[i] -= factor[i][k] * known[k];
    }
    asked[i] /= factor[i][i];
    known[i] /= factor[i][i];
    out.log_ratio += asked[i] * known[i];
    out.variance -= squared(asked[i]);
  }
  return out;
}

void keep_nearest(std::vector<Observation>& observations) {
  if (observations.size() <= nearest_max) return;
  std::stable_sort(observations.begin(), observations.end(),
                   [](const Observation& a, const Observation& b) { return a.apart < b.apart; });
  observations.resize(nearest_max);
}

// Encoding error decreases with the distance of the eye.
double encoded_detail(const Viewpoint& viewpoint) { return 1 / std::sqrt(viewpoint.height); }

}  // namespace

Forecast prior(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint) {
  const Expected error = expected_error(kind, setting, viewpoint);
  Forecast out;
  out.error = error.value;
  out.spread = std::hypot(error.scatter.signature, error.scatter.viewpoint);
  out.ms = expected_ms(kind, setting, viewpoint).value;
  return out;
}

void Table::add(std::size_t setting, const Viewpoint& viewpoint, const Measured& measured) {
  const auto is_bad = [](const std::optional<double>& value) {
    return value && !std::isfinite(*value);
  };
  if (is_bad(measured.error) || is_bad(measured.ms)) return;
  const Setting& how = settings[setting];
  Entry entry{viewpoint, {}, {}, is_merged(how, viewpoint)};
  if (measured.error) {
    const double error = std::max(*measured.error, error_least);
    entry.log_error = std::log(error / expected_error(kind_, how, viewpoint).value);
  }
  if (measured.ms) {
    entry.log_ms =
        std::log(std::max(*measured.ms, ms_least) / expected_ms(kind_, how, viewpoint).value);
  }
  std::deque<Entry>& entries = entries_[setting];
  entries.push_back(entry);
  if (entries.size() <= measurements_max) return;
  // Times come from calibration runs only, so entries without one are removed first.
  const auto oldest = std::find_if(entries.begin(), entries.end() - 1,
                                   [](const Entry& kept) { return !kept.log_ms; });
  entries.erase(oldest == entries.end() - 1 ? entries.begin() : oldest);
}

Forecast Table::forecast(std::size_t setting, const Viewpoint& viewpoint) const {
  const Setting& how = settings[setting];
  const bool merged = is_merged(how, viewpoint);
  Forecast out = prior(kind_, how, viewpoint);
  std::vector<Observation> errors;
  std::vector<Observation> times;
  for (const Entry& entry : entries_[setting]) {
    const double apart = distance(entry.viewpoint, viewpoint);
    // Merged data and data in full detail follow different laws.
    if (entry.log_error && entry.merged == merged) {
      errors.push_back({&entry.viewpoint, *entry.log_error, apart});
    }
    if (entry.log_ms) times.push_back({&entry.viewpoint, *entry.log_ms, apart});
  }
  if (!errors.empty()) {
    out.measured = std::any_of(errors.begin(), errors.end(),
                               [](const Observation& o) { return o.apart < near; });
    keep_nearest(errors);
    const Kriged kriged = krige(errors, expected_error(kind_, how, viewpoint).scatter);
    out.error = std::max(error_least, out.error * std::exp(kriged.log_ratio));
    out.spread = std::sqrt(kriged.variance);
  }
  if (!times.empty()) {
    keep_nearest(times);
    out.ms *= std::exp(krige(times, expected_ms(kind_, how, viewpoint).scatter).log_ratio);
    out.timed = true;
  }
  return out;
}

Forecasts Table::forecasts(const Viewpoint& viewpoint) const {
  Forecasts out;
  double log_ratio = 0;
  int timed = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = forecast(i, viewpoint);
    if (!out[i].timed) continue;
    log_ratio += std::log(out[i].ms / prior(kind_, settings[i], viewpoint).ms);
    ++timed;
  }
  if (timed == 0) return out;
  for (Forecast& guessed : out) {
    if (!guessed.timed) guessed.ms *= std::exp(log_ratio / timed);
  }
  return out;
}

bool Table::wants_study(const Viewpoint& viewpoint) const {
  return !studying_ && std::none_of(studied_.begin(), studied_.end(), [&](const Viewpoint& known) {
    return distance(known, viewpoint) < near;
  });
}

void Table::begin_study(const Viewpoint& viewpoint) {
  studying_ = true;
  studied_.push_back(viewpoint);
  if (studied_.size() > studies_max) studied_.pop_front();
}

void Table::end_study(bool complete) {
  studying_ = false;
  if (!complete && !studied_.empty()) studied_.pop_back();
}

void Table::add_encoding(int quality, const Viewpoint& viewpoint, double error) {
  const double known = error / (relative_quantisation_error(quality) * encoded_detail(viewpoint));
  if (!(known > 0) || !std::isfinite(known)) return;
  encoding_error_ = encoding_error_ ? std::sqrt(*encoding_error_ * known) : known;
}

double Table::encoding_error(int quality, bool full_chroma, const Viewpoint& viewpoint) const {
  const double prior = kind_.lines ? encoding_error_of_lines : encoding_error_of_media;
  const double at_90 = encoding_error_ ? *encoding_error_ * encoded_detail(viewpoint) : prior;
  return at_90 * std::hypot(relative_quantisation_error(quality), full_chroma ? 0 : half_chroma);
}

}  // namespace windsplat::quality
