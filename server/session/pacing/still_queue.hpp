// The stills that a client has requested and that are not yet being drawn.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

#include "protocol/messages.hpp"
#include "protocol/view.hpp"
#include "server/base/error.hpp"

namespace windsplat::session {

struct Still {
  protocol::StillMessage message;
  protocol::View view;  // the view with the picture size of the still
  std::uint32_t rev = 0;
  double t = 0;
};

// A still and moving frames take turns.
class StillQueue {
 public:
  static constexpr std::size_t waiting_max = 2;

  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  // Sets the size of the picture: the size in the message, otherwise that of the view, times the
  // scale in the message. Errors: too many stills wait, or it is too large.
  Result<void> add(Still still);
  Still take();

  // Call after a moving frame was sent.
  void moving_frame_sent();
  // Whether the next still precedes the next moving frame.
  [[nodiscard]] bool has_turn() const { return turn_; }

 private:
  std::deque<Still> waiting_;
  bool turn_ = false;  // a moving frame was sent since a still was requested
};

}  // namespace windsplat::session
