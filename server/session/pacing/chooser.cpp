// Walks the front of error against time with hysteresis.
#include "server/session/pacing/chooser.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace windsplat::session {
namespace {

// Time constant of the correction per setting when the view moves.
constexpr Micros correction_life_us = 4'000'000;
constexpr double newest_weight = 0.5;
constexpr double own_share = 0.3;
// A slower setting must also fit this fraction of the budget.
constexpr double headroom_to_change = 0.92;
}  // namespace

void Chooser::learn(std::size_t setting, Micros cost, const quality::Forecasts& forecasts,
                    Micros now) {
  const quality::Forecast& forecast = forecasts[setting];
  const double ratio =
      std::log(static_cast<double>(std::max<Micros>(cost, 1)) / (1000 * forecast.ms));
  // Corrections of guesses do not apply to calibrated times.
  const bool timed = std::any_of(forecasts.begin(), forecasts.end(),
                                 [](const quality::Forecast& known) { return known.timed; });
  if (!measured_ || timed_ != timed) {
    log_ratio_ = ratio;
    corrections_ = {};
    chosen_.reset();
    try_after_ = try_after_first;
  }
  measured_ = true;
  timed_ = timed;
  Correction& own = corrections_[setting];
  const bool fresh = own.known && now - own.at < correction_life_us;
  // Clamps the influence of a single disturbed frame.
  constexpr double believed = 0.92;  // a factor of 2.5
  const double beyond =
      std::clamp(ratio - log_ratio_ - (fresh ? own.log_ratio : 0), -believed, believed);
  // Load of the machine and the view affect all settings alike.
  log_ratio_ += (1 - own_share) * newest_weight * beyond;
  own.log_ratio = (fresh ? own.log_ratio : 0) + own_share * newest_weight * beyond;
  own.at = now;
  own.known = true;
}

Micros Chooser::expected(std::size_t setting, const quality::Forecasts& forecasts,
                         Micros now) const {
  const Correction& own = corrections_[setting];
  double log_ms = std::log(forecasts[setting].ms) + log_ratio_;
  if (own.known && now - own.at < correction_life_us) log_ms += own.log_ratio;
  return static_cast<Micros>(1000 * std::exp(log_ms));
}

bool Chooser::is_sure(std::size_t setting, const quality::Forecasts& forecasts, Micros now) const {
  const Correction& own = corrections_[setting];
  return forecasts[setting].timed || (own.known && now - own.at < correction_life_us);
}

quality::Choice Chooser::best(const protocol::View& view, const quality::Forecasts& forecasts,
                              const quality::Aim& aim, double pixels_most, Micros now) const {
  std::array<double, quality::settings_count> ms{};
  for (std::size_t i = 0; i < ms.size(); ++i) {
    ms[i] = 1e-3 * static_cast<double>(expected(i, forecasts, now));
  }
  return quality::pick(view, forecasts, ms, aim, pixels_most);
}

std::size_t Chooser::choose(const protocol::View& view, const quality::Forecasts& forecasts,
                            const quality::Aim& aim, double pixels_most, Micros now) {
  const quality::Choice wanted = best(view, forecasts, aim, pixels_most, now);
  // Hysteresis avoids flicker during motion; after a rest the choice starts again.
  constexpr Micros rest = 1'000'000;
  if (now - chosen_at_ > rest) chosen_.reset();
  chosen_at_ = now;
  const bool stays = chosen_ && quality::is_allowed(quality::settings[*chosen_], view) &&
                     quality::pixels_at(view, quality::settings[*chosen_]) <= pixels_most;
  if (!stays || !measured_ || !wanted.fits) {
    slack_ = 0;
    chosen_ = wanted.setting;
    return wanted.setting;
  }
  if (is_wrong(wanted.setting, forecasts, aim, now)) {
    // The tried setting did not fit.
    constexpr Micros of_the_try = 500'000;
    if (tried_at_ && now - *tried_at_ < of_the_try) {
      try_after_ = std::min(2 * std::max(try_after_, correction_life_us), try_after_most);
    }
    slack_ = 0;
    chosen_ = wanted.setting;
    return wanted.setting;
  }
  quality::Aim calm = aim;
  if (calm.budget_ms) *calm.budget_ms *= headroom_to_change;
  chosen_ = patient(best(view, forecasts, calm, pixels_most, now), forecasts, now);
  return *chosen_;
}

// Whether the current setting violates a limit that the desired one meets.
bool Chooser::is_wrong(std::size_t wanted, const quality::Forecasts& forecasts,
                       const quality::Aim& aim, Micros now) const {
  const std::size_t here = *chosen_;
  if (aim.budget_ms &&
      1e-3 * static_cast<double>(expected(here, forecasts, now)) > *aim.budget_ms) {
    return true;
  }
  return aim.max_error && quality::error_bound(forecasts[here]) > *aim.max_error &&
         quality::error_bound(forecasts[wanted]) <= *aim.max_error;
}

std::size_t Chooser::patient(const quality::Choice& calm, const quality::Forecasts& forecasts,
                             Micros now) {
  const std::size_t here = *chosen_;
  const std::size_t wanted = calm.setting;
  const bool better = forecasts[wanted].error < forecasts[here].error ||
                      expected(wanted, forecasts, now) < expected(here, forecasts, now);
  if (wanted == here || !calm.fits || !better) {
    slack_ = 0;
    return here;
  }
  if (++slack_ < slack_frames) return here;
  slack_ = 0;
  if (is_sure(wanted, forecasts, now)) return wanted;
  if (tried_at_ && now - *tried_at_ < try_after_) return here;
  tried_at_ = now;
  // Without calibration: the next finer resolution of the same kind.
  const quality::Setting& own = quality::settings[here];
  std::optional<std::size_t> next;
  for (std::size_t i = 0; i < quality::settings_count; ++i) {
    const quality::Setting& setting = quality::settings[i];
    if (setting.method == own.method && setting.coarser == own.coarser && setting.thinner == 1 &&
        setting.half_level < own.half_level &&
        (!next || setting.half_level > quality::settings[*next].half_level)) {
      next = i;
    }
  }
  return next.value_or(wanted);
}

std::optional<std::size_t> Chooser::least_error(const protocol::View& view,
                                                const quality::Forecasts& forecasts, Micros budget,
                                                Micros now) const {
  const quality::Choice found =
      best(view, forecasts, {1e-3 * static_cast<double>(budget), std::nullopt},
           std::numeric_limits<double>::infinity(), now);
  if (!found.fits) return std::nullopt;
  return found.setting;
}

}  // namespace windsplat::session
