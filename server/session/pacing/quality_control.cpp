#include "server/session/pacing/quality_control.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocol/limits.hpp"

namespace windsplat::session {
namespace {

constexpr double budget_ms_default = 33;
constexpr double budget_ms_least = 8;
constexpr int final_quality = 92;
constexpr int still_quality = 95;

Micros budget_of(const protocol::View& view) {
  return static_cast<Micros>(1000 * view.quality.budget_ms.value_or(budget_ms_default));
}

bool is_reference(const protocol::View& view) {
  return view.method.name == protocol::MethodName::reference;
}

Encoding full_quality(bool png, int jpeg_quality) {
  Encoding encoding;
  encoding.codec = png ? protocol::Codec::png : protocol::Codec::jpeg;
  encoding.quality = png ? 100 : jpeg_quality;
  encoding.full_chroma = true;
  return encoding;
}

}  // namespace

// If both are null, a stream keeps the default budget.
quality::Aim QualityControl::aim(const protocol::View& view) const {
  quality::Aim aim{view.quality.budget_ms, view.quality.max_error, true};
  if (aim.budget_ms || aim.max_error) return aim;
  // When sessions compete for the renderer, shorten the frames of all of them to raise the rate:
  // for n similar sessions by the root of n.
  const double waited = 1e-3 * waited_us();
  aim.budget_ms = std::max(budget_ms_least,
                           budget_ms_default * budget_ms_default / (budget_ms_default + waited));
  return aim;
}

// A new session waits as long as the others do.
double QualityControl::waited_us() const {
  if (queue_us_) return *queue_us_;
  return waiting_ ? static_cast<double>(waiting_()) : 0;
}

bool QualityControl::final_is_cheap(const protocol::View& view, Micros now) const {
  return times_.forecast(view, now).final_us <= budget_of(view);
}

FramePlan QualityControl::moving(const protocol::View& view, const Link& link, VideoChoice& video,
                                 Micros now) {
  FramePlan plan;
  const Micros budget = budget_of(view);
  const int least = encoding_.least_level(view, link, video, budget, now);
  const double whole = static_cast<double>(view.image.width) * view.image.height;
  const double pixels_most =
      least > 0 ? whole / std::pow(4.0, least) : std::numeric_limits<double>::infinity();
  if (!is_reference(view)) {
    if (view.quality != limits_) chooser_.forget();
    limits_ = view.quality;
    const quality::Aim limits = aim(view);
    // While frames wait for the renderer, tries delay those of other sessions.
    const auto may_try = [&] {
      if (waited_us() <= static_cast<double>(budget)) return true;
      return may_try_ && may_try_(times_.signature_of(view));
    };
    plan.setting = chooser_.choose(view, times_.forecast(view, now), limits,
                                   {pixels_most, encoding_.calm(view, link, video, Chooser::calm)},
                                   may_try, now);
    moving_setting_ = plan.setting;
  }
  plan.encoding = encoding_.choose(view, plan.setting, link, video, budget);
  return plan;
}

std::optional<FramePlan> QualityControl::refining(const protocol::View& view, const Link& link,
                                                  double shown_error, Micros now) const {
  constexpr Micros long_in_coming = 200'000;
  constexpr double better = 0.5;
  constexpr int usual = JpegRate::quality_usual;
  const FrameForecast forecast = times_.forecast(view, now);
  const quality::Forecasts& known = forecast.settings;
  const Micros cost = forecast.final_us;
  if (forecast.final_is_guessed || cost <= long_in_coming || is_reference(view))
    return std::nullopt;
  const Micros budget = cost / 4;
  const auto next = quality::pick(view, known, {1e-3 * static_cast<double>(budget), {}, true});
  if (!next.fits || !(known[next.setting].error < better * shown_error)) return std::nullopt;
  FramePlan plan;
  plan.setting = quality::settings[next.setting];
  plan.encoding.quality = usual;
  const double bytes = encoding_.jpeg_bytes_at(quality::pixels_at(view, plan.setting), usual);
  if (!(link.transfer(bytes) < cost / 2)) return std::nullopt;
  return plan;
}

quality::Setting QualityControl::final_setting(const protocol::View& view) const {
  quality::Setting setting = quality::settings[quality::own_setting(view)];
  if (thinner_ == 0) return setting;
  const int halvings = setting.method == protocol::MethodName::slab ? thinner_ : thinner_ - 1;
  setting.method = protocol::MethodName::slab;
  setting.thinner = 1 << halvings;
  return setting;
}

FramePlan QualityControl::final_frame(const protocol::View& view) const {
  FramePlan plan;
  plan.encoding = full_quality(view.quality.lossless, final_quality);
  plan.encoding.measure = true;
  if (!is_reference(view)) plan.setting = final_setting(view);
  return plan;
}

FramePlan QualityControl::still(const protocol::View& view, bool png) {
  return {quality::settings[quality::own_setting(view)], full_quality(png, still_quality)};
}

void QualityControl::on_view_changed(bool other_dataset) {
  thinner_ = 0;
  if (!other_dataset) return;
  chooser_ = Chooser();
  times_.forget();
}

void QualityControl::learn(const Render& render, const Drawn& drawn, const ViewState& state,
                           Micros now) {
  const protocol::View& view = state.view();
  if (drawn.info.method == "reference" || render.purpose == Purpose::still) return;
  if (render.dataset != view.dataset) return;
  if (!drawn.signature.key.empty() && render.version == state.version()) {
    times_.complete(view, drawn);
  }
  // Frames of other data than those of the setting do not predict its time.
  const bool stands_in = drawn.info.detail && drawn.info.detail->missing_bytes > 0;
  if (drawn.loaded || stands_in) return;
  if (render.purpose == Purpose::moving) {
    constexpr double newest = 0.2;
    queue_us_ = waited_us() + newest * (static_cast<double>(drawn.queue_us) - waited_us());
  }
  if (render.purpose == Purpose::final) {
    times_.learn_final(drawn.render_us + drawn.measure_us + drawn.encode_us, view, now);
  } else {
    const Micros cost = drawn.render_us + drawn.encode_us;
    if (times_.learn(render.setting, cost, view, now)) chooser_.restart();
  }
}

void QualityControl::learn_bytes(const Render& render, const Drawn& drawn, std::size_t frame_bytes,
                                 std::size_t text_bytes) {
  const int quality = render.encoding.quality;
  if (render.purpose == Purpose::moving) {
    encoding_.learn(drawn, quality, frame_bytes, text_bytes);
  } else if (render.purpose == Purpose::final && render.encoding.codec == protocol::Codec::jpeg) {
    encoding_.learn_final(drawn, quality, frame_bytes);
  }
}

bool QualityControl::needs_thinner_slabs(const Render& render, const Drawn& drawn,
                                         const ViewState& state) {
  constexpr int halvings_max = 4;
  const protocol::View& view = state.view();
  const auto& most = view.quality.max_error;
  if (render.purpose != Purpose::final || render.version != state.version() || !most) return false;
  if (!drawn.info.error_value || *drawn.info.error_value <= *most) return false;
  if (drawn.info.method == "reference" || thinner_ >= halvings_max) return false;
  // Errors of merged data are not reduced by thinner slabs.
  constexpr double mended = 0.67;
  if (thinner_ > 0 && *drawn.info.error_value > mended * thicker_error_) return false;
  thicker_error_ = *drawn.info.error_value;
  ++thinner_;
  if (view.method.slab_thickness / final_setting(view).thinner >=
      protocol::limits::slab_thickness_min) {
    return true;
  }
  --thinner_;
  return false;
}

}  // namespace windsplat::session
