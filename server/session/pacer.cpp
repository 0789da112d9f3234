// Decides which frame is drawn next, and when.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "protocol/limits.hpp"
#include "server/session/session.hpp"

namespace windsplat::session {
namespace {

constexpr double budget_ms_default = 33;
constexpr double budget_ms_least = 8;
constexpr int final_quality = 92;
constexpr int still_quality = 95;
constexpr std::size_t chosen_bytes = 600;  // approximate size of the message without its view
constexpr Micros tell_reading_after = 300'000;
constexpr Micros tell_reading_every = 250'000;

std::uint32_t clamped_us(std::int64_t us) {
  constexpr std::int64_t most = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(us, 0, most));
}

protocol::MethodCode method_code(const std::string& name) {
  if (name == "slab") return protocol::MethodCode::slab;
  if (name == "reference") return protocol::MethodCode::reference;
  return protocol::MethodCode::kernel;
}

// The view without its camera.
std::string without_camera(protocol::View view) {
  view.camera = {};
  return protocol::encode_view(view);
}

// The data of the view, apart from its step.
std::string fields_of(const protocol::View& view) {
  std::string names = view.dataset;
  const auto add = [&](const std::string& name) {
    names += '\n';
    names += name;
  };
  add(std::to_string(static_cast<int>(view.vector.field.kind)) + view.vector.field.name);
  add(view.vector.color.field.value_or(""));
  if (!view.scalars) add("default");
  for (const auto& scalar : view.scalars.value_or(std::vector<protocol::ScalarView>{})) {
    add(scalar.field);
  }
  return names;
}

// Whether only the background is visible. Unknown for the reference.
bool is_blank(const protocol::FrameInfo& info) {
  return info.method != "reference" && info.tiles == 0;
}

}  // namespace

// If both are null, a stream keeps the default budget.
quality::Aim Session::aim() const {
  quality::Aim aim{view_.quality.budget_ms, view_.quality.max_error};
  if (aim.budget_ms || aim.max_error) return aim;
  // When sessions compete for the renderer, shorten everyone's frames to raise the rate: for n
  // similar sessions by the root of n.
  const double waited = 1e-3 * queue_us_;
  aim.budget_ms = std::max(budget_ms_least,
                           budget_ms_default * budget_ms_default / (budget_ms_default + waited));
  return aim;
}

Micros Session::budget() const {
  return static_cast<Micros>(1000 * view_.quality.budget_ms.value_or(budget_ms_default));
}

bool Session::can_start() const {
  return !closed_ && !render_ && !writing_ && openings_.empty() &&
         sent_seq_ - acked_seq_ < std::uint32_t{protocol::limits::frames_in_flight_max};
}

bool Session::wants_final() const {
  // During fast playback a final frame would be outdated before it is shown.
  const bool still_enough = !player_.running() || player_.period() >= 4 * options_.quiet_us;
  return shown() && !drawn_final_ && still_enough && !hidden_;
}

void Session::advance_step(Micros now) {
  if (!player_.running() || hidden_ || !openings_.empty()) return;
  const auto [step, passed] = player_.advance(now, step_shown());
  if (passed > 0) {
    const bool left_out = started_version_ < step_version_;
    stats_.steps_dropped += static_cast<std::uint64_t>(passed - 1 + (left_out ? 1 : 0));
  }
  if (step == view_.step) return;
  std::string patch = "{\"step\":" + std::to_string(step) + '}';
  if (auto next = document_.patched(patch)) {
    change(std::move(*next), std::nullopt, std::move(patch), now);
  }
}

bool Session::wants_moving() const { return !shown() && !hidden_ && !view_.dataset.empty(); }

std::optional<Micros> Session::start_at() const {
  if (!can_start()) return std::nullopt;
  if (!stills_.empty() || wants_moving()) return link_.may_start_at();
  if (!wants_final()) return std::nullopt;
  return std::max(link_.may_start_at(), changed_at_ + rest());
}

Micros Session::rest() const {
  const Micros most = std::max(options_.quiet_us, options_.quiet_most_us);
  return std::clamp(link_.transfer(final_bytes_) / 2, options_.quiet_us, most);
}

void Session::start_next(Micros now) {
  const auto at = start_at();
  if (!at || now < *at) return;
  const bool moving = wants_moving();
  const bool quiet = now - changed_at_ >= rest();
  if (!stills_.empty() && (!moving || still_turn_)) {
    start_still(now);
  } else if (moving) {
    const bool cheap = final_cost(forecasts(), now) <= budget();
    // A client that stopped while out of credit can skip intermediate frames.
    if (quiet && cheap && !player_.running()) {
      start_final(now);
    } else {
      start_moving(now);
    }
  } else {
    start_refining(now);
  }
}

std::vector<int> Session::wanted_steps() const {
  constexpr int ahead_max = 16;
  if (closed_ || hidden_ || !openings_.empty() || view_.dataset.empty()) return {};
  if (player_.running()) return player_.upcoming(ahead_max);
  const bool rests = shown() && drawn_final_;
  const bool same = requested_.view.dataset == view_.dataset &&
                    requested_.view.step == view_.step && requested_fields_ == fields_of(view_);
  if (!rests) return same && requested_at_rest_ ? requested_.steps : std::vector<int>{};
  const auto count = surroundings_.check(view_);
  std::vector<int> steps;
  if (count && view_.step + 1 < *count) steps.push_back(view_.step + 1);
  if (count && view_.step > 0) steps.push_back(view_.step - 1);
  return steps;
}

void Session::request_prefetch() {
  std::vector<int> steps = wanted_steps();
  std::string fields = fields_of(view_);
  const bool none = steps.empty() && requested_.steps.empty();
  requested_at_rest_ = !player_.running();
  // Steps of playback are drawn at the setting of the previous one.
  const quality::Setting setting = player_.running() && !steps.empty()
                                       ? moving_setting_
                                       : quality::settings[quality::own_setting(view_)];
  const bool same = steps == requested_.steps && fields == requested_fields_;
  if (none || (same && (steps.empty() || setting == requested_.setting))) return;
  requested_ = {steps.empty() ? protocol::View{} : view_, std::move(steps), setting};
  requested_fields_ = std::move(fields);
  effects_.emplace_back(requested_);
}

// 0 for a description, the ticket for a frame.
std::optional<std::uint64_t> Session::waited_for() const {
  if (closed_ || !surroundings_.what_is_read || hidden_) return std::nullopt;
  if (!openings_.empty()) return 0;
  return render_ && !render_->unwanted ? std::optional(render_->ticket) : std::nullopt;
}

void Session::tell_reading(Micros now) {
  const auto what = waited_for();
  if (!what) return wait_.reset();
  if (!wait_ || wait_->what != *what) wait_ = Wait{*what, now + tell_reading_after};
  if (now < wait_->tell_at) return;
  wait_->tell_at = now + tell_reading_every;
  if (const auto reading = surroundings_.what_is_read(view_.dataset)) {
    effects_.emplace_back(SendText{protocol::ProgressMessage{
        std::nullopt, "loading " + reading->field, reading->done, std::nullopt}});
  }
}

// Expected time of a final frame, including the finer slab run that measures its error.
Micros Session::final_cost(const quality::Forecasts& known, Micros now) const {
  const bool slab = view_.method.name == protocol::MethodName::slab;
  const double factor = final_factor_.value_or(slab ? 2.6 : 6.4);
  const Micros own = chooser_.expected(quality::own_setting(view_), known, now);
  return static_cast<Micros>(factor * static_cast<double>(own));
}

// The scene signature is known after completion during drawing; before that use the method only.
quality::Forecasts Session::forecasts() const {
  quality::SceneSignature signature = quality::signature_of(view_);
  if (signature.key == drawn_style_) {
    signature = signature_;
  } else {
    signature.key.clear();
  }
  const quality::Viewpoint viewpoint = quality::viewpoint_of(view_, viewpoint_);
  if (surroundings_.forecasts) return surroundings_.forecasts(signature, viewpoint);
  quality::Forecasts out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = quality::prior(signature.kind, quality::settings[i], viewpoint);
  }
  return out;
}

// Learn times from frames drawn without loading only.
void Session::learn(const Render& render, const Drawn& drawn, Micros now) {
  if (drawn.info.method == "reference" || render.purpose == Purpose::still) return;
  if (render.dataset != view_.dataset) return;
  if (!drawn.signature.key.empty() && render.version == version_) {
    drawn_style_ = quality::signature_of(view_).key;
    signature_ = drawn.signature;
    viewpoint_ = drawn.viewpoint;
  }
  if (drawn.loaded) return;
  if (render.purpose == Purpose::moving) {
    constexpr double newest = 0.2;
    queue_us_ += newest * (static_cast<double>(drawn.queue_us) - queue_us_);
  }
  if (render.purpose == Purpose::final) {
    const auto cost = static_cast<double>(drawn.render_us + drawn.measure_us + drawn.encode_us);
    const auto own = chooser_.expected(quality::own_setting(view_), forecasts(), now);
    final_factor_ = cost / std::max(static_cast<double>(own), 1.0);
  } else if (const auto setting = quality::index_of(render.setting)) {
    chooser_.learn(*setting, drawn.render_us + drawn.encode_us, forecasts(), now);
  }
}

Session::Render Session::render_of(Purpose purpose, Micros now) const {
  Render render;
  render.purpose = purpose;
  render.begun = now;
  render.version = version_;
  render.rev = rev_;
  render.t = t_;
  return render;
}

void Session::start_moving(Micros now) {
  Render render = render_of(Purpose::moving, now);
  const int width = view_.image.width;
  const int height = view_.image.height;
  const int least = jpeg_.least_level(width, height, link_, budget());
  const double pixels_most = least > 0 ? static_cast<double>(width) * height / std::pow(4.0, least)
                                       : std::numeric_limits<double>::infinity();
  if (view_.method.name != protocol::MethodName::reference) {
    render.setting =
        quality::settings[chooser_.choose(view_, forecasts(), aim(), pixels_most, now)];
    moving_setting_ = render.setting;
  }
  render.encoding.quality =
      jpeg_.choose(quality::pixels_at(view_, render.setting), link_, budget());
  start(render, view_);
}

// Refinement before the final frame: half the error of the frame shown at a fraction of the final
// time.
void Session::start_refining(Micros now) {
  constexpr Micros long_in_coming = 200'000;
  constexpr double better = 0.5;
  const quality::Forecasts known = forecasts();
  const bool guessed = !final_factor_ && !known[quality::own_setting(view_)].timed;
  const Micros cost = final_cost(known, now);
  if (!guessed && cost > long_in_coming && view_.method.name != protocol::MethodName::reference) {
    constexpr int usual = JpegRate::quality_usual;
    const auto next = chooser_.least_error(view_, known, cost / 4, now);
    const auto on_link = [&](const quality::Setting& setting) {
      return link_.transfer(jpeg_.predicted_bytes(quality::pixels_at(view_, setting), usual));
    };
    if (next && known[*next].error < better * shown_error_ &&
        on_link(quality::settings[*next]) < cost / 2) {
      Render render = render_of(Purpose::refining, now);
      render.encoding.quality = usual;
      render.setting = quality::settings[*next];
      start(render, view_);
      return;
    }
  }
  start_final(now);
}

// The view as specified; with thinner slabs if its error would exceed maxError.
quality::Setting Session::final_setting() const {
  quality::Setting setting = quality::settings[quality::own_setting(view_)];
  if (thinner_ == 0) return setting;
  const int halvings = setting.method == protocol::MethodName::slab ? thinner_ : thinner_ - 1;
  setting.method = protocol::MethodName::slab;
  setting.thinner = 1 << halvings;
  return setting;
}

void Session::start_final(Micros now) {
  Render render = render_of(Purpose::final, now);
  const bool lossless = view_.quality.lossless;
  render.encoding.codec = lossless ? protocol::Codec::png : protocol::Codec::jpeg;
  render.encoding.quality = lossless ? 100 : final_quality;
  render.encoding.full_chroma = true;
  render.encoding.measure = true;
  if (view_.method.name != protocol::MethodName::reference) render.setting = final_setting();
  start(render, view_);
}

// Whether a final frame exceeds maxError and thinner slabs are possible.
bool Session::errs_too_much(const Render& render, const Drawn& drawn) {
  constexpr int halvings_max = 4;
  const auto& most = view_.quality.max_error;
  if (render.purpose != Purpose::final || render.version != version_ || !most) return false;
  if (!drawn.info.error_value || *drawn.info.error_value <= *most) return false;
  if (drawn.info.method == "reference" || thinner_ >= halvings_max) return false;
  // Errors of averaged data are not reduced by thinner slabs.
  constexpr double mended = 0.67;
  if (thinner_ > 0 && *drawn.info.error_value > mended * thicker_error_) return false;
  thicker_error_ = *drawn.info.error_value;
  ++thinner_;
  if (view_.method.slab_thickness / final_setting().thinner >=
      protocol::limits::slab_thickness_min) {
    return true;
  }
  --thinner_;
  return false;
}

void Session::start_still(Micros now) {
  const Still still = std::move(stills_.front());
  stills_.pop_front();
  still_turn_ = false;
  Render render = render_of(Purpose::still, now);
  render.rev = still.rev;
  render.t = still.t;
  render.still_id = still.message.id;
  const bool png = still.message.format == "png";
  render.encoding.codec = png ? protocol::Codec::png : protocol::Codec::jpeg;
  render.encoding.quality = png ? 100 : still_quality;
  render.encoding.full_chroma = true;
  render.setting = quality::settings[quality::own_setting(still.view)];
  start(render, still.view);
}

void Session::start(Render render, const protocol::View& view) {
  render.ticket = ++tickets_;
  render.step = view.step;
  render.dataset = view.dataset;
  if (render.purpose != Purpose::still) {
    render.played = player_.running() && started_version_ < step_version_;
    started_version_ = render.version;
  }
  effects_.emplace_back(StartRender{render.ticket, view, render.setting, render.encoding});
  render_ = render;
}

void Session::stand() {
  settle(version_);
  drawn_version_ = version_;
  drawn_final_ = true;
  standing_->view = protocol::encode_view(view_);
  // An undo may return to a rev that was never reported.
  if (!unanswered_ && standing_->rev == rev_) return;
  unanswered_.reset();
  standing_->rev = rev_;
  effects_.emplace_back(SendText{protocol::UnchangedMessage{rev_, standing_->seq}});
}

// Unless a pending frame would be shown after it.
void Session::confirm_unchanged() {
  if (shown() || !standing_) return;
  if (render_ && !render_->unwanted && render_->purpose != Purpose::still) return;
  if (protocol::encode_view(view_) == standing_->view) stand();
}

void Session::withhold(const Render& render) {
  settle(render.version);
  drawn_version_ = render.version;
  drawn_final_ = false;
  shown_error_ = 0;  // only the final frame can improve on it
}

bool Session::looks_standing(const Render& render, const Drawn& drawn) const {
  return render.purpose != Purpose::still && render.version == version_ && standing_ &&
         is_blank(drawn.info) && standing_->without_camera == without_camera(view_);
}

// Playback rate, reported about once a second, with the steps delayed by loading.
void Session::count_played(const Render& render, bool loaded, Micros now) {
  constexpr Micros window_us = 1'000'000;
  if (!player_.running()) {
    stats_.play_fps.reset();
    pace_.reset();
    return;
  }
  if (!render.played) return;
  if (loaded) ++stats_.steps_not_ready;
  if (!pace_) {
    pace_ = Pace{now, 0};
    return;
  }
  ++pace_->steps;
  const Micros passed = now - pace_->since;
  if (passed < window_us) return;
  stats_.play_fps = 1e6 * pace_->steps / static_cast<double>(passed);
  pace_ = Pace{now, 0};
  effects_.emplace_back(SendText{stats_});
}

void Session::send_frame(const Render& render, Drawn drawn, Micros now) {
  const bool still = render.purpose == Purpose::still;
  const bool final = render.purpose == Purpose::final && !errs_too_much(render, drawn);
  const bool moves = render.purpose == Purpose::moving;
  const Tier tier = still ? Tier::still : final ? Tier::final : moves ? Tier::moving : Tier::rest;
  const bool blank = is_blank(drawn.info);
  ++sent_seq_;
  writing_ = true;
  ++stats_.frames;
  const std::size_t frame_bytes = protocol::frame_header_bytes + drawn.payload->size();
  stats_.bytes += frame_bytes;
  const std::size_t text_bytes = chosen_bytes + drawn.view_json.size();
  link_.sent({sent_seq_, text_bytes + frame_bytes, render.begun, moves}, now);
  if (render.purpose == Purpose::final) {
    final_bytes_ = static_cast<double>(text_bytes + frame_bytes);
  }
  if (moves) {
    const double pixels = static_cast<double>(drawn.info.width) * drawn.info.height;
    jpeg_.learn(pixels, render.encoding.quality, frame_bytes, text_bytes);
  }

  protocol::FrameHeader header;
  header.seq = sent_seq_;
  header.rev = render.rev;
  header.step = static_cast<std::uint32_t>(render.step);
  header.flags = final || still ? protocol::flag_final : 0;
  if (drawn.info.error_kind == "measured") header.flags |= protocol::flag_error_measured;
  if (drawn.info.error_kind == "estimated") header.flags |= protocol::flag_error_estimated;
  header.width = static_cast<std::uint16_t>(drawn.info.width);
  header.height = static_cast<std::uint16_t>(drawn.info.height);
  header.codec = render.encoding.codec;
  header.quality = static_cast<std::uint8_t>(render.encoding.quality);
  header.method = method_code(drawn.info.method);
  header.level = quality::wire_level(render.setting.half_level);
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  header.error = static_cast<float>(drawn.info.error_value.value_or(unknown));
  header.jpeg_error = static_cast<float>(drawn.info.jpeg_error.value_or(unknown));
  // Do not refine twice if the error is unknown.
  const double otherwise = render.purpose == Purpose::refining ? 0 : 1;
  if (!still) shown_error_ = drawn.info.error_value.value_or(otherwise);
  header.queue_us = clamped_us(drawn.queue_us);
  header.render_us = clamped_us(drawn.render_us);
  header.encode_us = clamped_us(drawn.encode_us);
  header.payload_bytes = static_cast<std::uint32_t>(drawn.payload->size());
  header.t = render.t;

  effects_.emplace_back(Ping{sent_seq_});
  if (still) {
    effects_.emplace_back(SendText{protocol::ProgressMessage{render.still_id, "still", 1, 0.0}});
  }
  effects_.emplace_back(SendText{
      protocol::ChosenMessage{sent_seq_, std::move(drawn.info), std::move(drawn.view_json)}});
  effects_.emplace_back(SendFrame{header, std::move(drawn.payload), tier});
  if (still) return;
  count_played(render, drawn.loaded, now);
  if (!stills_.empty()) still_turn_ = true;
  settle(render.version);
  answered(render.version);
  drawn_version_ = render.version;
  drawn_final_ = final;
  standing_.reset();
  // A final frame is of the current view: any change would have cancelled it.
  if (drawn_final_) {
    standing_ = {sent_seq_, render.rev, protocol::encode_view(view_),
                 blank ? without_camera(view_) : std::string()};
  }
  if (!drawn_final_) return;
  effects_.emplace_back(SendText{stats_});
  if (!player_.running() && stills_.empty()) effects_.emplace_back(Calibrate{view_});
}

std::optional<Micros> Session::wake_at() const {
  if (closed_) return std::nullopt;
  Micros wake = heard_at_ + options_.idle_timeout_us;
  if (player_.running() && !hidden_ && openings_.empty()) {
    wake = std::min(wake, player_.next_at(step_shown()).value_or(wake));
  }
  if (wait_) wake = std::min(wake, wait_->tell_at);
  wake = std::min(wake, start_at().value_or(wake));
  return wake;
}

}  // namespace windsplat::session
