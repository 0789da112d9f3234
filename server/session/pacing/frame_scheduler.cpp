#include "server/session/pacing/frame_scheduler.hpp"

#include <algorithm>
#include <utility>

#include "server/session/pacing/quality_control.hpp"
#include "server/session/pacing/render_slot.hpp"

namespace windsplat::session {
namespace {

bool wants_moving(const SessionState& state) {
  return !state.view_is_shown() && !state.hidden && !state.view.view().dataset.empty();
}

bool wants_final(const SessionState& state) {
  // During fast playback a final frame would be outdated before it is shown.
  const bool still_enough =
      !state.player.running() || state.player.period() >= 4 * state.options.quiet_us;
  return state.view_is_shown() && !state.displayed.is_final() && still_enough && !state.hidden;
}

Render render_by(const SessionState& state, Purpose purpose, const FramePlan& plan, Micros now) {
  Render render;
  render.purpose = purpose;
  render.begun = now;
  render.version = state.view.version();
  render.rev = state.view.rev();
  render.t = state.view.t();
  render.setting = plan.setting;
  render.encoding = plan.encoding;
  return render;
}

void start(SessionState& state, Purpose purpose, const FramePlan& plan, Micros now) {
  Render render = render_by(state, purpose, plan, now);
  // Playback waits for the data of its steps, or drops them.
  render.may_stand_in = purpose == Purpose::moving && !state.player.running();
  render.played =
      state.player.running() && state.slot.started_version() < state.view.step_version();
  state.slot.start(std::move(render), state.view.view(), state.effects);
}

void start_still(SessionState& state, Micros now) {
  const Still still = state.stills.take();
  const FramePlan plan = QualityControl::still(still.view, still.message.format == "png");
  Render render = render_by(state, Purpose::still, plan, now);
  render.rev = still.rev;
  render.t = still.t;
  render.still_id = still.message.id;
  state.slot.start(std::move(render), still.view, state.effects);
}

void start_final(SessionState& state, Micros now) {
  start(state, Purpose::final, state.quality.final_frame(state.view.view()), now);
}

void start_moving(SessionState& state, Micros now) {
  const FramePlan plan =
      state.quality.moving(state.view.view(), state.flow.link(), state.video, now);
  if (plan.encoding.codec == protocol::Codec::h264) state.video.started(now);
  start(state, Purpose::moving, plan, now);
}

void start_refining(SessionState& state, Micros now) {
  const auto plan =
      state.quality.refining(state.view.view(), state.flow.link(), state.displayed.error(), now);
  if (!plan) return start_final(state, now);
  start(state, Purpose::refining, *plan, now);
}

}  // namespace

std::optional<Micros> next_render_at(const SessionState& state) {
  if (state.slot.render() || state.openings.pending() || !state.flow.has_credit()) {
    return std::nullopt;
  }
  const Micros link_at = state.flow.link().may_start_at();
  if (!state.stills.empty() || wants_moving(state)) return link_at;
  if (!wants_final(state)) return std::nullopt;
  return std::max(link_at, state.view.changed_at() + state.flow.rest(state.options));
}

void start_due_render(SessionState& state, Micros now) {
  const auto at = next_render_at(state);
  if (!at || now < *at) return;
  const bool moving = wants_moving(state);
  if (!state.stills.empty() && (!moving || state.stills.has_turn())) {
    start_still(state, now);
  } else if (moving) {
    const bool quiet = now - state.view.changed_at() >= state.flow.rest(state.options);
    const bool cheap = state.quality.final_is_cheap(state.view.view(), now);
    // A client that stopped while it had no credit can skip intermediate frames.
    if (quiet && cheap && !state.player.running()) {
      start_final(state, now);
    } else {
      start_moving(state, now);
    }
  } else {
    start_refining(state, now);
  }
}

}  // namespace windsplat::session
