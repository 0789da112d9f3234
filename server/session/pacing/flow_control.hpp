// Decides when the next frame may be started, by credit, the frame being written, and the link.
#pragma once

#include <cstddef>
#include <cstdint>

#include "protocol/messages.hpp"
#include "server/base/error.hpp"
#include "server/session/pacing/link.hpp"
#include "server/session/surroundings.hpp"

namespace windsplat::session {

class FlowControl {
 public:
  [[nodiscard]] const Link& link() const { return link_; }
  [[nodiscard]] std::uint32_t next_seq() const { return sent_seq_ + 1; }
  // Fewer than two frames are unacknowledged, and none is being written.
  [[nodiscard]] bool has_credit() const;
  // Time without a change that precedes a final frame: longer on a slow link.
  [[nodiscard]] Micros rest(const Options& options) const;

  struct Sent {
    std::size_t bytes = 0;  // including preceding text messages
    Micros begun = 0;       // start of its render
    bool moving = false;
    bool final = false;  // drawn as a final frame
  };
  // The frame of next_seq() is sent.
  void sent(const Sent& frame, Micros now);
  void written(Micros now);
  void answered(std::uint32_t seq, Micros now) { link_.answered(seq, now); }
  // Error: that frame was never sent.
  Result<void> acked(const protocol::AckMessage& message, Micros now);

 private:
  std::uint32_t sent_seq_ = 0;
  std::uint32_t acked_seq_ = 0;
  bool writing_ = false;
  double final_bytes_ = 0;  // size of the last final frame
  Link link_;
};

}  // namespace windsplat::session
