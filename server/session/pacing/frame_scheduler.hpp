// Decides which frame is drawn next, and when.
#pragma once

#include <optional>

#include "server/session/pacing/link.hpp"
#include "server/session/session_state.hpp"

namespace windsplat::session {

// Time when the next render starts in the current state; nullopt if there is nothing to draw or no
// credit.
std::optional<Micros> next_render_at(const SessionState& state);
void start_due_render(SessionState& state, Micros now);

}  // namespace windsplat::session
