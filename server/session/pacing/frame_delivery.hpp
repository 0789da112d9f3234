// Delivers the result of a render: a frame with its messages, `unchanged`, or an error.
#pragma once

#include "server/base/error.hpp"
#include "server/session/effects.hpp"
#include "server/session/pacing/link.hpp"
#include "server/session/pacing/render_slot.hpp"
#include "server/session/session_state.hpp"

namespace windsplat::session {

// The render has ended.
void deliver(SessionState& state, const Render& render, Result<Drawn> drawn, Micros now);
// Responds with `unchanged` if the final frame displayed is valid for the current view, unless a
// pending frame would be shown after it.
void confirm_unchanged(SessionState& state);

}  // namespace windsplat::session
