// Applies the messages of a client to the state of its session.
#pragma once

#include "protocol/messages.hpp"
#include "server/session/pacing/link.hpp"
#include "server/session/session_state.hpp"

namespace windsplat::session {

// A visitor of protocol::ClientMessage.
class MessageHandler {
 public:
  MessageHandler(SessionState& state, Micros now) : state_(state), now_(now) {}

  void operator()(const protocol::OpenMessage& message);
  void operator()(const protocol::PatchMessage& message);
  void operator()(const protocol::StillMessage& message);
  void operator()(const protocol::PlayMessage& message);
  void operator()(const protocol::PauseMessage& message);
  void operator()(const protocol::AckMessage& message);
  void operator()(const protocol::VisibilityMessage& message);
  void operator()(const protocol::VideoMessage& message);

 private:
  SessionState& state_;
  const Micros now_;
};

}  // namespace windsplat::session
