// Pacing of a session: which frame to draw next, and when.
#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "protocol/limits.hpp"
#include "server/session/session.hpp"

namespace windsplat::session {
namespace {

constexpr double budget_ms_default = 33;
constexpr int moving_quality = 75;
constexpr int final_quality = 92;
constexpr int still_quality = 95;

std::uint32_t clamped_us(std::int64_t us) {
  constexpr std::int64_t most = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(us, 0, most));
}

protocol::MethodCode method_code(const std::string& name) {
  if (name == "slab") return protocol::MethodCode::slab;
  if (name == "reference") return protocol::MethodCode::reference;
  return protocol::MethodCode::kernel;
}

// The view but for where it is looked at from.
std::string without_camera(protocol::View view) {
  view.camera = {};
  return protocol::encode_view(view);
}

// Whether nothing but the background shows. The reference does not tell.
bool is_blank(const protocol::FrameInfo& info) {
  return info.method != "reference" && info.tiles == 0;
}

}  // namespace

Micros Session::budget() const {
  return static_cast<Micros>(1000 * view_.quality.budget_ms.value_or(budget_ms_default));
}

bool Session::can_start() const {
  return !closed_ && !render_ && !writing_ && openings_.empty() &&
         sent_seq_ - acked_seq_ < std::uint32_t{protocol::limits::frames_in_flight_max};
}

bool Session::wants_final() const {
  // While steps run by quickly a final frame would be out of date before it is seen.
  const bool still_enough = !player_.running() || player_.period() >= 4 * options_.quiet_us;
  return shown() && !drawn_final_ && still_enough && !hidden_;
}

void Session::advance_step(Micros now) {
  if (!player_.running() || hidden_ || !openings_.empty()) return;
  const int step = player_.step_at(now, shown());
  if (step == view_.step) return;
  std::string patch = "{\"step\":" + std::to_string(step) + '}';
  if (auto next = document_.patched(patch)) {
    change(std::move(*next), std::nullopt, std::move(patch), now);
  }
}

void Session::start_next(Micros now) {
  if (!can_start()) return;
  const bool moving = !shown() && !hidden_ && !view_.dataset.empty();
  const bool quiet = now - changed_at_ >= options_.quiet_us;
  if (!stills_.empty() && (!moving || still_turn_)) {
    start_still();
  } else if (moving) {
    const int width = view_.image.width;
    const int height = view_.image.height;
    const bool cheap = final_cost(width, height, now) <= budget();
    // A viewer that has stopped while its credit was out need not see a lesser frame first.
    if (quiet && cheap && !player_.running()) {
      start_final();
    } else {
      start_moving(now);
    }
  } else if (wants_final() && quiet) {
    start_final();
  }
}

// What a final frame is expected to take: by slab, what the last one of its kind took, or at first
// several times what a moving frame does.
Micros Session::final_cost(int width, int height, Micros now) const {
  const Micros moving = levels_.expected(0, width, height, now);
  if (view_.method.name == protocol::MethodName::kernel) return moving;
  constexpr Micros dearer = 4;
  return std::max(moving, last_final_cost_.value_or(dearer * moving));
}

Session::Render Session::render_of(Purpose purpose) const {
  Render render;
  render.purpose = purpose;
  render.version = version_;
  render.rev = rev_;
  render.t = t_;
  return render;
}

void Session::start_moving(Micros now) {
  Render render = render_of(Purpose::moving);
  render.encoding.quality = moving_quality;
  render.encoding.level = levels_.choose(view_.image.width, view_.image.height, budget(), now);
  // While the view changes, more pixels are worth more than slabs: see docs/study.
  protocol::View view = view_;
  if (view.method.name == protocol::MethodName::slab) {
    view.method.name = protocol::MethodName::kernel;
  }
  start(render, view);
}

void Session::start_final() {
  Render render = render_of(Purpose::final);
  render.encoding.quality = final_quality;
  render.encoding.full_chroma = true;
  start(render, view_);
}

void Session::start_still() {
  const Still still = std::move(stills_.front());
  stills_.pop_front();
  still_turn_ = false;
  Render render = render_of(Purpose::still);
  render.rev = still.rev;
  render.t = still.t;
  render.still_id = still.message.id;
  const bool png = still.message.format == "png";
  render.encoding.codec = png ? protocol::Codec::png : protocol::Codec::jpeg;
  render.encoding.quality = png ? 100 : still_quality;
  render.encoding.full_chroma = true;
  start(render, still.view);
}

void Session::start(Render render, const protocol::View& view) {
  render.ticket = ++tickets_;
  render.step = view.step;
  render.width = view.image.width;
  render.height = view.image.height;
  effects_.emplace_back(StartRender{render.ticket, view, render.encoding});
  render_ = render;
}

void Session::stand() {
  settle(version_);
  drawn_version_ = version_;
  drawn_final_ = true;
  standing_->view = protocol::encode_view(view_);
  // An undo may have gone back to a rev that was never told.
  if (!unanswered_ && standing_->rev == rev_) return;
  unanswered_.reset();
  standing_->rev = rev_;
  effects_.emplace_back(SendText{protocol::UnchangedMessage{rev_, standing_->seq}});
}

// Unless something else is on its way, which the viewer would see last.
void Session::stand_if_same() {
  if (shown() || !standing_) return;
  if (render_ && !render_->unwanted && render_->purpose != Purpose::still) return;
  if (protocol::encode_view(view_) == standing_->view) stand();
}

void Session::withhold(const Render& render) {
  settle(render.version);
  drawn_version_ = render.version;
  drawn_final_ = false;
}

bool Session::looks_standing(const Render& render, const Drawn& drawn) const {
  return render.purpose != Purpose::still && render.version == version_ && standing_ &&
         is_blank(drawn.info) && standing_->without_camera == without_camera(view_);
}

void Session::send_frame(const Render& render, Drawn drawn) {
  const bool still = render.purpose == Purpose::still;
  const bool blank = is_blank(drawn.info);
  ++sent_seq_;
  writing_ = true;
  ++stats_.frames;
  stats_.bytes += protocol::frame_header_bytes + drawn.payload->size();

  protocol::FrameHeader header;
  header.seq = sent_seq_;
  header.rev = render.rev;
  header.step = static_cast<std::uint32_t>(render.step);
  header.flags = render.purpose == Purpose::moving ? 0 : protocol::flag_final;
  header.width = static_cast<std::uint16_t>(drawn.info.width);
  header.height = static_cast<std::uint16_t>(drawn.info.height);
  header.codec = render.encoding.codec;
  header.quality = static_cast<std::uint8_t>(render.encoding.quality);
  header.method = method_code(drawn.info.method);
  header.level = static_cast<std::uint8_t>(render.encoding.level);
  header.error = std::numeric_limits<float>::quiet_NaN();
  header.jpeg_error = std::numeric_limits<float>::quiet_NaN();
  header.queue_us = clamped_us(drawn.queue_us);
  header.render_us = clamped_us(drawn.render_us);
  header.encode_us = clamped_us(drawn.encode_us);
  header.payload_bytes = static_cast<std::uint32_t>(drawn.payload->size());
  header.t = render.t;

  if (still) {
    effects_.emplace_back(SendText{protocol::ProgressMessage{render.still_id, "still", 1, 0.0}});
  }
  effects_.emplace_back(SendText{
      protocol::ChosenMessage{sent_seq_, std::move(drawn.info), std::move(drawn.view_json)}});
  effects_.emplace_back(SendFrame{header, std::move(drawn.payload)});
  if (still) return;
  if (!stills_.empty()) still_turn_ = true;
  settle(render.version);
  answered(render.version);
  drawn_version_ = render.version;
  drawn_final_ = render.purpose == Purpose::final;
  standing_.reset();
  // A final frame is of the present view: any change would have ended it.
  if (drawn_final_) {
    standing_ = {sent_seq_, render.rev, protocol::encode_view(view_),
                 blank ? without_camera(view_) : std::string()};
  }
  if (drawn_final_) effects_.emplace_back(SendText{stats_});
}

std::optional<Micros> Session::wake_at() const {
  if (closed_) return std::nullopt;
  Micros wake = heard_at_ + options_.idle_timeout_us;
  if (player_.running() && !hidden_ && openings_.empty()) {
    wake = std::min(wake, player_.next_at(shown()).value_or(wake));
  }
  if (can_start() && wants_final()) wake = std::min(wake, changed_at_ + options_.quiet_us);
  return wake;
}

}  // namespace windsplat::session
