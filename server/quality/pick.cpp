// Selection of a setting from the trade-off of error against time.
#include "server/quality/pick.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

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
  const PictureSize size = size_at(view, setting);
  return static_cast<double>(size.width) * size.height;
}

Forecasts with_encoding(const protocol::View& view, Forecasts forecasts, double ms_a_pixel) {
  for (std::size_t i = 0; i < forecasts.size(); ++i) {
    forecasts[i].ms += ms_a_pixel * pixels_at(view, settings[i]);
  }
  return forecasts;
}

bool is_candidate(const Setting& setting, const protocol::View& view, const Aim& aim) {
  const bool any_finer = aim.max_error && !aim.before_final;
  return is_allowed(setting, view) && (any_finer || !is_finer(setting, view));
}

namespace {

double pixels_of(const PictureSize& size) { return static_cast<double>(size.width) * size.height; }

bool is_candidate(const Option& option, const Aim& aim, const protocol::View& view) {
  return (aim.max_error && !aim.before_final) || !is_finer(option.setting, view);
}

}  // namespace

Choice pick(const protocol::View& view, const Forecasts& forecasts, const Aim& aim,
            double pixels_most) {
  Sizes sizes;
  const std::vector<Option> options = options_of(view, forecasts, std::nullopt, sizes);
  Choice choice = pick(view, options, aim, pixels_most);
  choice.setting = index_of(options[choice.setting].setting).value();
  return choice;
}

Choice pick(const protocol::View& view, const std::vector<Option>& options, const Aim& aim,
            double pixels_most, const std::optional<Near>& near) {
  const double budget =
      aim.budget_ms ? headroom * *aim.budget_ms : std::numeric_limits<double>::max();
  const bool any_small = std::any_of(options.begin(), options.end(), [&](const auto& option) {
    return is_candidate(option, aim, view) && pixels_of(option.size) <= pixels_most;
  });
  Candidate keeps_both;
  Candidate least_error;  // within the time budget
  Candidate fastest;
  for (std::size_t i = 0; i < options.size(); ++i) {
    const auto& [setting, forecast, size] = options[i];
    if (!is_candidate(options[i], aim, view)) continue;
    if (any_small && pixels_of(size) > pixels_most) continue;
    if (near && sizes_apart(setting, near->from) > near->step) continue;
    fastest.take(i, forecast.ms);
    if (forecast.ms > budget) continue;
    least_error.take(i, forecast.error);
    if (aim.max_error && error_bound(forecast) <= *aim.max_error) keeps_both.take(i, forecast.ms);
  }
  if (keeps_both.found()) return {keeps_both.setting, true};
  if (least_error.found()) return {least_error.setting, true};
  return {fastest.setting, false};
}

}  // namespace windsplat::quality
