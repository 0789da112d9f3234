// Selection of a setting from the trade-off of error against time.
#include "server/quality/pick.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace windsplat::quality {
namespace {

// Times vary: a setting fits if its expected time is at most this fraction of the budget.
constexpr double headroom = 0.92;
constexpr double spreads = 1.65;  // standard deviations to the 95 % quantile

struct Candidate {
  std::size_t setting = 0;
  double value = std::numeric_limits<double>::infinity();
  [[nodiscard]] bool found() const { return std::isfinite(value); }
  void take(std::size_t other, double its_value) {
    if (its_value < value) *this = {other, its_value};
  }
};

}  // namespace

double error_bound(const Forecast& forecast) {
  return forecast.error * std::exp(spreads * forecast.spread);
}

double error_low(const Forecast& forecast) {
  return forecast.error * std::exp(-spreads * forecast.spread);
}

double pixels_at(const protocol::View& view, const Setting& setting) {
  return static_cast<double>(edge_at(view.image.width, setting.half_level)) *
         edge_at(view.image.height, setting.half_level);
}

bool is_candidate(const Setting& setting, const protocol::View& view, const Aim& aim) {
  const bool any_finer = aim.max_error && !aim.before_final;
  return is_allowed(setting, view) && (any_finer || !is_finer(setting, view));
}

Choice pick(const protocol::View& view, const Forecasts& forecasts, const Aim& aim,
            double pixels_most) {
  const double budget =
      aim.budget_ms ? headroom * *aim.budget_ms : std::numeric_limits<double>::max();
  const bool any_small = std::any_of(settings.begin(), settings.end(), [&](const auto& setting) {
    return is_candidate(setting, view, aim) && pixels_at(view, setting) <= pixels_most;
  });
  Candidate keeps_both;
  Candidate least_error;  // within the time budget
  Candidate fastest;
  for (std::size_t i = 0; i < settings_count; ++i) {
    const bool large = pixels_at(view, settings[i]) > pixels_most;
    if (!is_candidate(settings[i], view, aim) || (any_small && large)) continue;
    const double ms = forecasts[i].ms;
    fastest.take(i, ms);
    if (ms > budget) continue;
    least_error.take(i, forecasts[i].error);
    if (aim.max_error && error_bound(forecasts[i]) <= *aim.max_error) keeps_both.take(i, ms);
  }
  if (keeps_both.found()) return {keeps_both.setting, true};
  if (least_error.found()) return {least_error.setting, true};
  return {fastest.setting, false};
}

}  // namespace windsplat::quality
