// Walks the front of error against time with hysteresis.
#include "server/session/pacing/chooser.hpp"

#include <algorithm>

namespace windsplat::session {
namespace {

// Time constant of retrying a setting that did not fit.
constexpr Micros retry_us = 4'000'000;
// A slower setting must also fit this fraction of the budget.
constexpr double headroom_to_change = 0.92;

}  // namespace

void Chooser::restart() {
  measured_ = true;
  chosen_.reset();
  try_after_ = try_after_first;
}

std::size_t Chooser::choose(const protocol::View& view, const quality::Forecasts& forecasts,
                            const quality::Aim& aim, double pixels_most, Micros now) {
  const quality::Choice wanted = quality::pick(view, forecasts, aim, pixels_most);
  // Hysteresis avoids flicker during motion; after a rest the choice starts again.
  constexpr Micros rest = 1'000'000;
  if (now - chosen_at_ > rest) chosen_.reset();
  chosen_at_ = now;
  const bool stays = chosen_ && quality::is_candidate(quality::settings[*chosen_], view, aim) &&
                     quality::pixels_at(view, quality::settings[*chosen_]) <= pixels_most;
  if (stays && measured_ && wanted.fits) {
    if (!is_wrong(wanted.setting, forecasts, aim)) {
      quality::Aim calm = aim;
      if (calm.budget_ms) *calm.budget_ms *= headroom_to_change;
      chosen_ = patient(quality::pick(view, forecasts, calm, pixels_most), forecasts, now);
      return *chosen_;
    }
    // The tried setting did not fit.
    constexpr Micros of_the_try = 500'000;
    if (tried_ == chosen_ && now - *tried_at_ < of_the_try) {
      try_after_ = std::min(2 * std::max(try_after_, retry_us), try_after_most);
      tried_.reset();
    }
  }
  slack_ = 0;
  chosen_ = wanted.setting;
  return wanted.setting;
}

// Whether the current setting violates a limit that the desired one meets.
bool Chooser::is_wrong(std::size_t wanted, const quality::Forecasts& forecasts,
                       const quality::Aim& aim) const {
  const std::size_t here = *chosen_;
  if (aim.budget_ms && forecasts[here].ms > *aim.budget_ms) return true;
  return aim.max_error && quality::error_bound(forecasts[here]) > *aim.max_error &&
         quality::error_bound(forecasts[wanted]) <= *aim.max_error;
}

std::size_t Chooser::patient(const quality::Choice& calm, const quality::Forecasts& forecasts,
                             Micros now) {
  const std::size_t here = *chosen_;
  const std::size_t wanted = calm.setting;
  const bool better =
      forecasts[wanted].error < forecasts[here].error || forecasts[wanted].ms < forecasts[here].ms;
  if (wanted == here || !calm.fits || !better) {
    slack_ = 0;
    return here;
  }
  if (++slack_ < slack_frames) return here;
  slack_ = 0;
  if (forecasts[wanted].timed) return wanted;
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
  tried_ = next.value_or(wanted);
  return *tried_;
}

}  // namespace windsplat::session
