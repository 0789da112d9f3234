// Playback within a session: advances the view to the step that is due, and reports the rate.
#pragma once

#include <optional>

#include "server/session/pacing/link.hpp"
#include "server/session/pacing/render_slot.hpp"
#include "server/session/session_state.hpp"

namespace windsplat::session {

// Time when the next step is due; nullopt if playback is stopped or waits for a frame.
std::optional<Micros> next_step_at(const SessionState& state);
void advance_playback(SessionState& state, Micros now);
// Call after the frame of the render was sent. Sends the playback rate about once a second, with
// the number of steps delayed by loading.
void count_played(SessionState& state, const Render& render, bool loaded, Micros now);

}  // namespace windsplat::session
