// Predict, then correct.
#include "server/session/pacing/frame_times.hpp"

#include <algorithm>
#include <cmath>

namespace windsplat::session {
namespace {

// Time constant of the correction per setting when the view moves.
constexpr Micros correction_life_us = 4'000'000;
constexpr double newest_weight = 0.5;
constexpr double own_share = 0.3;

}  // namespace

quality::Forecasts FrameTimes::uncorrected(const protocol::View& view) const {
  quality::SceneSignature signature = quality::signature_of(view);
  quality::Viewpoint last = viewpoint_;
  if (signature.key == drawn_key_) {
    signature = signature_;
  } else {
    signature.key.clear();
    last.content.reset();
  }
  const quality::Viewpoint viewpoint = quality::viewpoint_of(view, last);
  if (forecaster_) return forecaster_(signature, viewpoint);
  return quality::Table(signature.kind).forecasts(viewpoint);
}

bool FrameTimes::Correction::is_recent(Micros now) const {
  return at && now - *at < correction_life_us;
}

FrameForecast FrameTimes::forecast(const protocol::View& view, Micros now) const {
  FrameForecast out{uncorrected(view)};
  const quality::Forecast& own = out.settings[quality::own_setting(view)];
  out.final_is_guessed = !final_factor_ && !own.timed;
  for (std::size_t i = 0; i < out.settings.size(); ++i) {
    quality::Forecast& forecast = out.settings[i];
    const Correction& correction = measured_.own[i];
    const bool recent = correction.is_recent(now);
    const double log_ms = std::log(forecast.ms) + measured_.log_ratio;
    forecast.ms = std::exp(recent ? log_ms + correction.log_ratio : log_ms);
    forecast.ms = 1e-3 * std::trunc(1000 * forecast.ms);  // whole microseconds
    forecast.timed = forecast.timed || recent;
  }
  const bool slab = view.method.name == protocol::MethodName::slab;
  const double factor = final_factor_.value_or(slab ? 2.6 : 6.4);
  out.final_us = static_cast<Micros>(factor * std::round(1000 * own.ms));
  return out;
}

void FrameTimes::complete(const protocol::View& view, const Drawn& drawn) {
  drawn_key_ = quality::signature_of(view).key;
  signature_ = drawn.signature;
  viewpoint_ = drawn.viewpoint;
}

bool FrameTimes::learn(std::size_t setting, Micros cost, const protocol::View& view, Micros now) {
  const quality::Forecasts forecasts = uncorrected(view);
  const double ratio =
      std::log(static_cast<double>(std::max<Micros>(cost, 1)) / (1000 * forecasts[setting].ms));
  // Corrections of guesses do not apply to calibrated times.
  const bool timed = std::any_of(forecasts.begin(), forecasts.end(),
                                 [](const quality::Forecast& known) { return known.timed; });
  const bool restarts = !measured_.any || measured_.timed != timed;
  if (restarts) measured_ = {true, timed, ratio, {}};
  Correction& own = measured_.own[setting];
  const double before = own.is_recent(now) ? own.log_ratio : 0;
  // Clamps the influence of a single disturbed frame.
  constexpr double believed = 0.92;  // a factor of 2.5
  const double beyond = std::clamp(ratio - measured_.log_ratio - before, -believed, believed);
  // Load of the machine and the view affect all settings alike.
  measured_.log_ratio += (1 - own_share) * newest_weight * beyond;
  own = {before + own_share * newest_weight * beyond, now};
  return restarts;
}

void FrameTimes::learn_final(Micros cost, const protocol::View& view, Micros now) {
  const double own_ms = forecast(view, now).settings[quality::own_setting(view)].ms;
  final_factor_ = static_cast<double>(cost) / std::max(std::round(1000 * own_ms), 1.0);
}

void FrameTimes::forget() {
  drawn_key_.clear();
  viewpoint_ = {};
  measured_ = {};
  final_factor_.reset();
}

}  // namespace windsplat::session
