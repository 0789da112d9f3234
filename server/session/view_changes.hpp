// Applies changes to the view of a session: cancels renders of the view at rest, and resets what
// was learned about another dataset.
#pragma once

#include <cstdint>
#include <string>

#include "protocol/codec.hpp"
#include "protocol/messages.hpp"
#include "server/session/pacing/link.hpp"
#include "server/session/session_state.hpp"

namespace windsplat::session {

// `next` is the view with the patch applied.
void change_view(SessionState& state, protocol::ViewDocument next, std::string patch_json,
                 Micros now);
void change_view(SessionState& state, protocol::ViewDocument next,
                 const protocol::PatchMessage& patch, Micros now);
void change_step(SessionState& state, int step, Micros now);
// The same view must be drawn again.
void renew_view(SessionState& state, Micros now);
// Call when the change of that version was rejected later.
void undo_change(SessionState& state, std::uint64_t version, Micros now);

}  // namespace windsplat::session
