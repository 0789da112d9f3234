// Nearby measurements -> forecasts, in logarithms.
#include "server/quality/table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "server/quality/laws.hpp"

namespace windsplat::quality {
namespace {

constexpr double ms_least = 1e-3;
constexpr double near = 0.5;       // distance below which a calibration run adds no information
constexpr double told_within = 1;  // distance beyond which the error of a level tells nothing
constexpr std::size_t nearest_max = 8;
// Correlations of the errors of settings by cause: order of kernels, fewer pixels, merged samples,
// slabs (the residuals of the laws over the generated family).
constexpr std::array<std::array<double, 4>, 4> correlations{{
    {0.85, 0, 0, 0.15},
    {0, 0.85, 0.5, 0},
    {0, 0.5, 0.85, 0},
    {0.15, 0, 0, 0.85},
}};

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

struct Kriged {
  double log_ratio = 0;
  double variance = 0;  // with the noise of a new measurement
};

double squared(double x) { return x * x; }

// The logarithm of a measured over an expected value.
struct TimeObservation {
  const Viewpoint* viewpoint = nullptr;
  double log_ratio = 0;
  double apart = 0;  // distance from the requested viewpoint
};

// Simple kriging with mean 0: solves C w = c by Cholesky factorisation, with the forward
// substitution of c row by row. `own` is the variance of a new measurement, requested(i) the
// covariance of observation i with the requested value, between(i, j) that of two observations,
// which includes the noise where i = j.
template <class Known, class Requested, class Between>
Kriged krige(std::size_t count, double own, const Known& known_at, const Requested& requested,
             const Between& between) {
  std::array<std::array<double, nearest_max>, nearest_max> factor{};
  std::array<double, nearest_max> asked{};
  std::array<double, nearest_max> known{};
  Kriged out;
  out.variance = own;
  for (std::size_t i = 0; i < count; ++i) {
    asked[i] = requested(i);
    known[i] = known_at(i);
    for (std::size_t j = 0; j <= i; ++j) {
      double c = between(i, j);
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

// signature^2 + viewpoint^2 exp(-distance), and noise^2 for the same measurement.
Kriged krige_times(std::vector<TimeObservation> times, const Scatter& scatter) {
  std::stable_sort(
      times.begin(), times.end(),
      [](const TimeObservation& a, const TimeObservation& b) { return a.apart < b.apart; });
  times.resize(std::min(times.size(), nearest_max));
  const auto shared = [&](double apart) {
    return squared(scatter.signature) + squared(scatter.viewpoint) * std::exp(-apart);
  };
  return krige(
      times.size(), shared(0) + squared(scatter.noise),
      [&](std::size_t i) { return times[i].log_ratio; },
      [&](std::size_t i) { return shared(times[i].apart); },
      [&](std::size_t i, std::size_t j) {
        return shared(distance(*times[i].viewpoint, *times[j].viewpoint)) +
               (i == j ? squared(scatter.noise) : 0);
      });
}

// Encoding error decreases with the distance of the eye.
double encoded_detail(const Viewpoint& viewpoint) { return 1 / std::sqrt(viewpoint.height); }

double spread_of(const Scatter& scatter) {
  return std::hypot(scatter.signature, scatter.viewpoint);
}

// Correlation of the errors of two causes, beyond what the laws express.
double correlation(Cause a, Cause b) {
  return correlations[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)];
}

// The logarithm of a measured over an expected error, in units of the spread of its cause.
struct ErrorObservation {
  std::size_t setting = 0;
  Cause cause = Cause::kernel;
  const Viewpoint* viewpoint = nullptr;
  double log_ratio = 0;
  double apart = 0;      // distance from the requested viewpoint
  double closeness = 0;  // exp(-apart)
  // Of its content, which was a guess: standard deviation in the same units, and what it has in
  // common with a guess at the requested viewpoint.
  double guessed = 0;
  double guess_shared = 0;
};

}  // namespace

// The measured errors of a table, as seen from one viewpoint.
class NearErrors {
 public:
  NearErrors(const Table& table, const Viewpoint& viewpoint) {
    std::size_t count = 0;
    for (const auto& entries : table.entries_) count += entries.size();
    all_.reserve(count);
    for (std::size_t i = 0; i < settings_count; ++i) {
      first_[i] = all_.size();
      for (const Table::Entry& entry : table.entries_[i]) {
        if (!entry.log_error) continue;
        const double apart = distance(entry.viewpoint, viewpoint);
        const double guessed =
            std::sqrt(entry.guessed) * error_scatter(table.kind_, entry.cause).content;
        all_.push_back({i, entry.cause, &entry.viewpoint, *entry.log_error / entry.spread, apart,
                        std::exp(-apart), guessed / entry.spread,
                        1 - unknown_share(entry.viewpoint, viewpoint)});
      }
    }
    first_[settings_count] = all_.size();
  }

  [[nodiscard]] bool empty() const { return all_.empty(); }

  // Whether the error of the setting was measured at a viewpoint near enough.
  [[nodiscard]] bool is_measured(std::size_t setting, Cause cause) const {
    return std::any_of(all_.data() + first_[setting], all_.data() + first_[setting + 1],
                       [&](const auto& e) { return e.cause == cause && e.apart < near; });
  }

  // From the observations that correlate most: those of the setting itself, and those selected once
  // for all settings of the cause. What a guess of the content leaves out, `guessed` being its
  // standard deviation, is common to all errors of a view, less so the farther views are apart.
  [[nodiscard]] Kriged krige_at(std::size_t setting, Cause cause, const Scatter& scatter,
                                double guessed) {
    const auto covariance = [&](const ErrorObservation& e, std::size_t b, Cause cause_b,
                                double closeness) {
      const bool same = e.setting == b && e.cause == cause_b;
      return (same ? 1 : correlation(e.cause, cause_b)) *
             (squared(scatter.signature) + squared(scatter.viewpoint) * closeness);
    };
    struct Candidate {
      const ErrorObservation* error = nullptr;
      double shared = 0;  // covariance with the requested error
    };
    std::array<Candidate, 2 * nearest_max + Table::measurements_max> found;
    std::size_t count = 0;
    const auto take = [&](const ErrorObservation& e) {
      found[count++] = {&e, covariance(e, setting, cause, e.closeness)};
    };
    for (const ErrorObservation* e : nearest_by_cause(cause, covariance)) {
      if (e->setting != setting) take(*e);
    }
    for (std::size_t n = first_[setting]; n < first_[setting + 1]; ++n) take(all_[n]);
    const std::size_t used = std::min(count, nearest_max);
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(used),
                      found.begin() + static_cast<std::ptrdiff_t>(count),
                      [](const Candidate& a, const Candidate& b) { return a.shared > b.shared; });
    const double noise = squared(scatter.noise);
    const double unit = spread_of(scatter);
    const auto alike = [](const ErrorObservation& e, std::size_t b, Cause cause_b) {
      return e.setting == b && e.cause == cause_b ? 1 : correlation(e.cause, cause_b);
    };
    return krige(
        used, squared(scatter.signature) + squared(scatter.viewpoint) + noise + squared(guessed),
        [&](std::size_t i) { return found[i].error->log_ratio * unit; },
        [&](std::size_t i) {
          const ErrorObservation& e = *found[i].error;
          return found[i].shared +
                 alike(e, setting, cause) * unit * e.guessed * guessed * e.guess_shared;
        },
        [&](std::size_t i, std::size_t j) {
          const ErrorObservation& a = *found[i].error;
          const ErrorObservation& b = *found[j].error;
          const double apart = distance(*a.viewpoint, *b.viewpoint);
          double guesses = squared(unit) * a.guessed * b.guessed * alike(a, b.setting, b.cause);
          if (i != j) guesses *= 1 - unknown_share(*a.viewpoint, *b.viewpoint);
          return covariance(a, b.setting, b.cause, std::exp(-apart)) + guesses +
                 (i == j ? noise : 0);
        });
  }

 private:
  // The observations that correlate most with another setting of the cause; as many again as are
  // used, because those of the setting itself are among them.
  template <class Covariance>
  const std::vector<const ErrorObservation*>& nearest_by_cause(Cause cause,
                                                               const Covariance& covariance) {
    std::vector<const ErrorObservation*>& nearest = by_cause_[static_cast<std::size_t>(cause)];
    if (!nearest.empty()) return nearest;
    std::vector<std::pair<double, const ErrorObservation*>> order;
    order.reserve(all_.size());
    for (const ErrorObservation& e : all_) {
      order.emplace_back(covariance(e, settings_count, cause, e.closeness), &e);
    }
    const auto kept = static_cast<std::ptrdiff_t>(std::min(order.size(), 2 * nearest_max));
    std::partial_sort(order.begin(), order.begin() + kept, order.end(),
                      [](const auto& a, const auto& b) { return a.first > b.first; });
    nearest.reserve(static_cast<std::size_t>(kept));
    for (auto one = order.begin(); one != order.begin() + kept; ++one) {
      nearest.push_back(one->second);
    }
    return nearest;
  }

  std::vector<ErrorObservation> all_;                    // by setting
  std::array<std::size_t, settings_count + 1> first_{};  // of each setting
  std::array<std::vector<const ErrorObservation*>, 4> by_cause_;
};

Forecast prior(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint) {
  const Expected error = expected_error(kind, setting, viewpoint);
  Forecast out;
  out.error = error.value;
  out.spread = std::hypot(spread_of(error.scatter), viewpoint.content ? 0 : error.scatter.content);
  out.ms = expected_ms(kind, setting, viewpoint).value;
  return out;
}

void Table::add(std::size_t setting, const Viewpoint& seen, const Measured& measured) {
  const auto is_bad = [](const std::optional<double>& value) {
    return value && !std::isfinite(*value);
  };
  if (is_bad(measured.error) || is_bad(measured.ms)) return;
  const Setting& how = settings[setting];
  const Sight sight = measured.error ? filled(seen) : Sight{seen, seen.content ? 0.0 : 1.0};
  const Viewpoint& viewpoint = sight.viewpoint;
  Entry entry{viewpoint, {}, {}, false, sight.guessed, cause_of(how, viewpoint), 1};
  entry.spread = spread_of(error_scatter(kind_, entry.cause));
  if (measured.error) {
    const double error = std::max(*measured.error, error_least);
    entry.log_error = std::log(error / expected_error(kind_, how, viewpoint).value);
    if (!std::isfinite(*entry.log_error)) return;
  }
  if (measured.ms) {
    entry.log_ms =
        std::log(std::max(*measured.ms, ms_least) / expected_ms(kind_, how, viewpoint).value);
  }
  std::deque<Entry>& entries = entries_[setting];
  entries.push_back(entry);
  if (entries.size() <= measurements_max) return;
  // Times of frames are removed first, then errors without a time.
  const auto last = entries.end() - 1;
  auto oldest =
      std::find_if(entries.begin(), last, [](const Entry& kept) { return kept.of_frames; });
  if (oldest == last) {
    oldest = std::find_if(entries.begin(), last, [](const Entry& kept) { return !kept.log_ms; });
  }
  entries.erase(oldest == last ? entries.begin() : oldest);
}

void Table::add_frame(std::size_t setting, const Viewpoint& viewpoint, double ms) {
  constexpr double weight_of_new = 0.2;
  ++frames_since_try_;
  for (Entry& entry : entries_[setting]) {
    if (!entry.log_ms || distance(entry.viewpoint, viewpoint) >= near) continue;
    if (!entry.of_frames) return;
    const double expected = expected_ms(kind_, settings[setting], entry.viewpoint).value;
    *entry.log_ms += weight_of_new * (std::log(std::max(ms, ms_least) / expected) - *entry.log_ms);
    return;
  }
  add(setting, viewpoint, {std::nullopt, ms});
  entries_[setting].back().of_frames = true;
}

void Table::describe(const Viewpoint& viewpoint) {
  if (!viewpoint.content) return;
  const auto is_same = [&](const Viewpoint& other) { return is_same_view(other, viewpoint); };
  described_.erase(std::remove_if(described_.begin(), described_.end(), is_same), described_.end());
  described_.push_back(viewpoint);
  if (described_.size() > descriptions_max) described_.pop_front();
  for (std::size_t i = 0; i < settings_count; ++i) {
    for (Entry& entry : entries_[i]) {
      if (entry.guessed == 0 || !entry.log_error || !is_same(entry.viewpoint)) continue;
      const auto log_expected = [&] {
        return std::log(expected_error(kind_, settings[i], entry.viewpoint).value);
      };
      const double log_measured = *entry.log_error + log_expected();
      entry.viewpoint.content = viewpoint.content;
      entry.log_error = log_measured - log_expected();
      entry.guessed = 0;
    }
  }
}

std::optional<Content> Table::content(const Viewpoint& viewpoint) const {
  const Viewpoint* const known = nearest_known(viewpoint);
  if (known == nullptr || !is_same_view(*known, viewpoint)) return std::nullopt;
  return known->content;
}

std::optional<DetailError> Table::detail(const Viewpoint& viewpoint) const {
  const Viewpoint* nearest = nullptr;
  double apart = 0;
  for (const Viewpoint& known : described_) {
    if (!known.content->detail) continue;
    const double its = is_same_view(known, viewpoint) ? -1 : distance(known, viewpoint);
    if (its >= (nearest != nullptr ? apart : told_within)) continue;
    nearest = &known;
    apart = its;
  }
  return nearest != nullptr ? nearest->content->detail : std::nullopt;
}

bool Table::begin_try() {
  constexpr int frames_least = 100;
  if (frames_since_try_ < frames_least) return false;
  frames_since_try_ = 0;
  return true;
}

const Viewpoint* Table::nearest_known(const Viewpoint& viewpoint) const {
  const Viewpoint* nearest = nullptr;
  double apart = 0;
  const auto compare = [&](const Viewpoint& known) {
    const double its = is_same_view(known, viewpoint) ? -1 : distance(known, viewpoint);
    if (nearest != nullptr && its >= apart) return;
    nearest = &known;
    apart = its;
  };
  for (const Viewpoint& described : described_) compare(described);
  for (const std::deque<Entry>& entries : entries_) {
    for (const Entry& entry : entries) {
      if (entry.guessed == 0) compare(entry.viewpoint);
    }
  }
  return nearest;
}

Table::Sight Table::filled(const Viewpoint& viewpoint) const {
  if (viewpoint.content) return {viewpoint, 0};
  const Viewpoint* const nearest = nearest_known(viewpoint);
  if (nearest == nullptr) return {viewpoint, 1};
  Sight out{viewpoint, unknown_share(*nearest, viewpoint)};
  out.viewpoint.content = scaled(*nearest->content, nearest->height / viewpoint.height);
  return out;
}

Forecast Table::forecast_at(std::size_t setting, const Sight& sight, NearErrors& errors) const {
  const Setting& how = settings[setting];
  const Viewpoint& viewpoint = sight.viewpoint;
  Forecast out = prior(kind_, how, viewpoint);
  const Cause cause = cause_of(how, viewpoint);
  const Scatter& of_error = error_scatter(kind_, cause);
  const double guessed = std::sqrt(sight.guessed) * of_error.content;
  out.spread = std::hypot(spread_of(of_error), guessed);
  if (!errors.empty()) {
    out.measured = errors.is_measured(setting, cause);
    const Kriged kriged = errors.krige_at(setting, cause, of_error, guessed);
    out.error = std::clamp(out.error * std::exp(kriged.log_ratio), error_least, 1.0);
    out.spread = std::sqrt(kriged.variance);
  }
  std::vector<TimeObservation> times;
  for (const Entry& entry : entries_[setting]) {
    if (!entry.log_ms) continue;
    times.push_back({&entry.viewpoint, *entry.log_ms, distance(entry.viewpoint, viewpoint)});
  }
  if (!times.empty()) {
    const Scatter scatter = expected_ms(kind_, how, viewpoint).scatter;
    out.ms *= std::exp(krige_times(std::move(times), scatter).log_ratio);
    out.timed = true;
  }
  return out;
}

Forecast Table::forecast(std::size_t setting, const Viewpoint& seen) const {
  const Sight sight = filled(seen);
  NearErrors errors(*this, sight.viewpoint);
  return forecast_at(setting, sight, errors);
}

Forecasts Table::forecasts(const Viewpoint& seen) const {
  const Sight sight = filled(seen);
  NearErrors errors(*this, sight.viewpoint);
  Forecasts out;
  double log_ratio = 0;
  int timed = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = forecast_at(i, sight, errors);
    if (!out[i].timed) continue;
    log_ratio += std::log(out[i].ms / expected_ms(kind_, settings[i], sight.viewpoint).value);
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
