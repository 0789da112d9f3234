#include "server/session/playback/playback.hpp"

#include "server/session/view_changes.hpp"

namespace windsplat::session {
namespace {

bool advances(const SessionState& state) {
  return state.player.running() && !state.hidden && !state.openings.pending();
}

}  // namespace

std::optional<Micros> next_step_at(const SessionState& state) {
  if (!advances(state)) return std::nullopt;
  return state.player.next_at(state.step_is_shown());
}

void advance_playback(SessionState& state, Micros now) {
  if (!advances(state)) return;
  const auto [step, passed] = state.player.advance(now, state.step_is_shown());
  if (passed > 0) {
    const bool left_out = state.slot.started_version() < state.view.step_version();
    state.stats.steps_dropped += static_cast<std::uint64_t>(passed - 1 + (left_out ? 1 : 0));
  }
  if (step != state.view.view().step) change_step(state, step, now);
}

void count_played(SessionState& state, const Render& render, bool loaded, Micros now) {
  if (!state.player.running()) {
    state.stats.play_fps.reset();
    state.playback_rate.reset();
    return;
  }
  if (!render.played) return;
  if (loaded) ++state.stats.steps_not_ready;
  if (const auto rate = state.playback_rate.shown(now)) {
    state.stats.play_fps = *rate;
    state.send(state.stats);
  }
}

}  // namespace windsplat::session
