// Walks the front of error against time with hysteresis.
#include "server/session/pacing/chooser.hpp"

#include <algorithm>
#include <utility>

namespace windsplat::session {
namespace {

// Time constant of retrying a setting that did not fit.
constexpr Micros retry_us = 4'000'000;
// A slower setting must also fit this fraction of the budget, and have this share of the error.
constexpr double headroom_to_change = 0.96;
constexpr double better = 0.985;
// A faster setting must be as much faster, if it is not needed for the budget.
constexpr double worth_its_change = 0.9;
// Where no neighbour in size is better, one that is further away must have at most this share of
// the error.
constexpr double worth_a_leap = 0.75;

}  // namespace

void Chooser::restart() {
  measured_ = true;
  chosen_.reset();
  try_after_ = try_after_first;
}

quality::Setting Chooser::choose(const protocol::View& view, const FrameForecast& forecast,
                                 const quality::Aim& aim, const Limits& limits,
                                 const std::function<bool()>& may_try, Micros now) {
  // After a rest the choice starts again.
  constexpr Micros rest = 1'000'000;
  if (now - chosen_at_ > rest) chosen_.reset();
  chosen_at_ = now;
  const Case one{
      view,        quality::options_of(view, forecast.settings, forecast.halvings, sizes_, chosen_),
      aim,         limits.pixels_most,
      limits.calm, may_try,
      now};
  const quality::Choice wanted = quality::pick(view, one.options, aim, limits.pixels_most);
  const quality::Option* const here = measured_ ? current(one) : nullptr;
  if (here == nullptr) {
    go(one.options[wanted.setting].setting, now);
  } else if (is_wrong(*here, wanted, one)) {
    if (is_a_try(now)) {  // which did not fit
      try_after_ = std::min(2 * std::max(try_after_, retry_us), try_after_most);
      tried_.reset();
    }
    go(one.options[wanted.setting].setting, now);
  } else {
    step(*here, one);
  }
  return *chosen_;
}

// The chosen setting, if it is still permitted.
const quality::Option* Chooser::current(const Case& one) const {
  if (!chosen_ || !quality::is_candidate(*chosen_, one.view, one.aim)) return nullptr;
  if (quality::pixels_at(one.view, *chosen_) > one.pixels_most) return nullptr;
  const auto here =
      std::find_if(one.options.begin(), one.options.end(),
                   [&](const quality::Option& option) { return option.setting == *chosen_; });
  return here == one.options.end() ? nullptr : &*here;
}

// Whether the current setting violates a limit by far that the desired one meets, or meets better.
bool Chooser::is_wrong(const quality::Option& here, const quality::Choice& wanted,
                       const Case& one) const {
  const quality::Forecast& other = one.options[wanted.setting].forecast;
  constexpr Micros soon = 500'000;
  const bool mistaken = slower_since_ && one.now - *slower_since_ < soon;
  const double late = is_a_try(one.now) || mistaken ? 1 : far_beyond;
  if (one.aim.budget_ms && here.forecast.ms > late * *one.aim.budget_ms &&
      other.ms < worth_its_change * here.forecast.ms) {
    return true;
  }
  return one.aim.max_error && wanted.fits &&
         quality::error_bound(here.forecast) > *one.aim.max_error &&
         quality::error_bound(other) <= *one.aim.max_error;
}

bool Chooser::is_a_try(Micros now) const {
  constexpr Micros lasts = 1'500'000;
  return tried_ && tried_ == chosen_ && now - *tried_at_ < lasts;
}

void Chooser::go(const quality::Setting& setting, Micros now) {
  if (chosen_ != setting) changed_at_ = now;
  slower_since_.reset();
  impatience_ = 0;
  chosen_ = setting;
}

void Chooser::step(const quality::Option& here, const Case& one) {
  const bool late = one.aim.budget_ms && here.forecast.ms > *one.aim.budget_ms;
  quality::Aim aim = one.aim;
  if (aim.budget_ms && !late) *aim.budget_ms *= headroom_to_change;
  const quality::Near near{here.setting, quality::sixteenths_per_half_level};
  quality::Choice next = quality::pick(one.view, one.options, aim, one.pixels_most, near);
  const auto is_worth = [&](double share_of_error) {
    const quality::Forecast& other = one.options[next.setting].forecast;
    const bool is_faster = other.ms < worth_its_change * here.forecast.ms;
    if (late) return is_faster || (next.fits && other.ms < here.forecast.ms);
    return next.fits &&
           (other.error < share_of_error * here.forecast.error || (one.aim.max_error && is_faster));
  };
  bool changes = is_worth(better);
  Micros least = late ? calm : one.calm;
  // Where changes are dear, one far change replaces several.
  if (!late && (!changes || one.calm > calm)) {
    const quality::Choice nearest =
        std::exchange(next, quality::pick(one.view, one.options, aim, one.pixels_most));
    if (is_worth(worth_a_leap)) {
      changes = true;
      least = calm;
    } else {
      next = nearest;
    }
  }
  if (!changes) {
    impatience_ = 0;
    return;
  }
  const quality::Option& other = one.options[next.setting];
  if (++impatience_ < patient_frames || one.now - changed_at_ < least) return;
  if (other.forecast.timed || late) {
    go(other.setting, one.now);
    if (other.forecast.ms > here.forecast.ms) slower_since_ = one.now;
  } else {
    try_finer(here, one);
  }
}

// The next finer resolution of the same kind.
void Chooser::try_finer(const quality::Option& here, const Case& one) {
  if (tried_at_ && one.now - *tried_at_ < try_after_) return;
  const quality::Setting& own = here.setting;
  std::optional<quality::Setting> next;
  for (const quality::Setting& setting : quality::settings) {
    if (setting.method == own.method && setting.coarser == own.coarser && setting.thinner == 1 &&
        setting.half_level < own.half_level && (!next || setting.half_level > next->half_level)) {
      next = setting;
    }
  }
  if (!next || !one.may_try()) return;
  tried_at_ = one.now;
  tried_ = next;
  go(*next, one.now);
}

}  // namespace windsplat::session
