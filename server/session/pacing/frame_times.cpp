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
constexpr double guessed_share = 0.5;  // of a setting whose time was a guess

// A final frame for which so much work is expected takes long enough for a frame before it, even if
// most kernels turn out to be empty or hidden: where samples are merged for a first frame of the
// default budget, the final one of slabs is expected to take this long.
constexpr double certainly_long_us = 300'000;

// The time of a setting over that of method `kernel` at full size: merged samples have two values,
// slabs take about four times as long, and half of the work does not depend on the size.
double share_of_work(const quality::Setting& setting) {
  const double merged = setting.coarser > 0 ? 2 * std::pow(8.0, -setting.coarser) : 1;
  const double slabs = setting.method == protocol::MethodName::slab ? 4 : 1;
  return merged * slabs * (0.5 + 0.5 * std::exp2(-setting.half_level));
}

// A single frame may have been disturbed: what the one before it does not confirm counts little.
double believed(double newest, double last) {
  constexpr double most = 0.92;  // a factor of 2.5
  constexpr double most_alone = 0.1;
  const double both = std::min(std::abs(newest), std::abs(last));
  const double confirmed = newest * last > 0 ? std::copysign(both, newest) : 0;
  return std::clamp(confirmed + std::clamp(newest - confirmed, -most_alone, most_alone), -most,
                    most);
}

}  // namespace

std::optional<quality::Kind> FrameTimes::kind_of_another(const protocol::View& view) const {
  const quality::SceneSignature signature = quality::signature_of(view);
  if (signature.key == drawn_key_) return std::nullopt;
  return signature.kind;
}

quality::SceneSignature FrameTimes::signature_of(const protocol::View& view) const {
  const auto another = kind_of_another(view);
  return another ? quality::SceneSignature{{}, view.dataset, *another} : signature_;
}

quality::Forecasts FrameTimes::uncorrected(const protocol::View& view,
                                           const std::optional<quality::Kind>& another) const {
  quality::SceneSignature signature = signature_;
  quality::Viewpoint last = viewpoint_;
  if (another) {
    signature = {{}, view.dataset, *another};
    last.content.reset();
  }
  quality::Viewpoint viewpoint = quality::viewpoint_of(view, last);
  if (!another && viewpoint.identity == asked_identity_) {
    viewpoint.identity = last.identity;
    viewpoint.content = last.content;
  }
  if (forecaster_) return forecaster_(signature, viewpoint);
  return quality::Table(signature.kind).forecasts(viewpoint);
}

bool FrameTimes::Correction::is_recent(Micros now) const {
  return at && now - *at < correction_life_us;
}

double FrameTimes::raise_by_work(const protocol::View& view, quality::Forecasts& settings) const {
  const double whole_ms = time_by_work_ ? time_by_work_(view) : 0;
  const bool timed = std::any_of(settings.begin(), settings.end(),
                                 [](const quality::Forecast& known) { return known.timed; });
  for (std::size_t i = 0; !timed && !measured_.any && i < settings.size(); ++i) {
    const quality::Setting& setting = quality::settings[i];
    const double ms = whole_ms * share_of_work(setting);
    settings[i].ms = std::max(settings[i].ms, ms);
  }
  return 1000 * whole_ms * share_of_work(quality::settings[quality::own_setting(view)]);
}

FrameForecast FrameTimes::forecast(const protocol::View& view, Micros now) const {
  const auto another = kind_of_another(view);
  FrameForecast out{uncorrected(view, another)};
  const quality::Forecast& own = out.settings[quality::own_setting(view)];
  out.final_is_guessed = !final_factor_ && !own.timed;
  const double least_us = out.final_is_guessed ? raise_by_work(view, out.settings) : 0;
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
  out.final_us = static_cast<Micros>(factor * std::max(std::round(1000 * own.ms), least_us));
  if (factor * least_us > certainly_long_us) out.final_is_guessed = false;
  const quality::PictureSize size{view.image.width, view.image.height};
  if (size == drawn_size_ && !another) out.halvings = halvings_;
  return out;
}

void FrameTimes::complete(const protocol::View& view, const Drawn& drawn) {
  drawn_key_ = quality::signature_of(view).key;
  signature_ = drawn.signature;
  viewpoint_ = drawn.viewpoint;
  asked_identity_ = quality::viewpoint_of(view).identity;
  halvings_ = drawn.halvings;
  drawn_size_ = {view.image.width, view.image.height};
}

bool FrameTimes::learn(const quality::Setting& setting, Micros cost, const protocol::View& view,
                       Micros now) {
  const quality::Forecasts forecasts = uncorrected(view, kind_of_another(view));
  const double expected_ms = quality::forecast_between(setting, forecasts).ms;
  const double ratio =
      std::log(static_cast<double>(std::max<Micros>(cost, 1)) / (1000 * expected_ms));
  // Corrections of guesses do not apply to calibrated times.
  const bool timed = std::any_of(forecasts.begin(), forecasts.end(),
                                 [](const quality::Forecast& known) { return known.timed; });
  const bool restarts = !measured_.any || measured_.timed != timed;
  if (restarts) measured_ = {true, timed, ratio, 0, {}};
  // A size between two settings is forecast from both.
  const auto neighbours = quality::neighbours_of(setting).value();
  const std::size_t larger = neighbours[0];
  const std::size_t smaller = neighbours[1];
  const auto before = [&](std::size_t i) {
    return measured_.own[i].is_recent(now) ? measured_.own[i].log_ratio : 0;
  };
  const double own_log_ms =
      std::log(quality::forecast_between(setting,
                                         [&](std::size_t i) {
                                           quality::Forecast corrected = forecasts[i];
                                           corrected.ms *= std::exp(before(i));
                                           return corrected;
                                         })
                   .ms /
               expected_ms);
  const double newest = ratio - measured_.log_ratio - own_log_ms;
  const double of_larger = before(larger);
  const double of_smaller = before(smaller);
  const auto is_known = [&](std::size_t i) {
    return forecasts[i].timed || measured_.own[i].is_recent(now);
  };
  const bool known = is_known(larger) && is_known(smaller);
  const double beyond = believed(newest, known ? measured_.beyond : newest);
  measured_.beyond = newest;
  const double weight = known ? newest_weight : 1;
  const double share = known ? own_share : guessed_share;
  // Load of the machine and the view affect all settings alike.
  measured_.log_ratio += (1 - share) * weight * beyond;
  const double change = share * weight * beyond;
  measured_.own[larger] = {of_larger + change, now};
  measured_.own[smaller] = {of_smaller + change, now};
  return restarts;
}

void FrameTimes::learn_final(Micros cost, const protocol::View& view, Micros now) {
  const double own_ms = forecast(view, now).settings[quality::own_setting(view)].ms;
  final_factor_ = static_cast<double>(cost) / std::max(std::round(1000 * own_ms), 1.0);
}

void FrameTimes::forget() {
  drawn_key_.clear();
  viewpoint_ = {};
  asked_identity_ = 0;
  drawn_size_ = {};
  measured_ = {};
  final_factor_.reset();
}

}  // namespace windsplat::session
