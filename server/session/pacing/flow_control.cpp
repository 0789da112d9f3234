#include "server/session/pacing/flow_control.hpp"

#include <algorithm>
#include <string>

#include "protocol/limits.hpp"

namespace windsplat::session {

bool FlowControl::has_credit() const {
  return !writing_ &&
         sent_seq_ - acked_seq_ < std::uint32_t{protocol::limits::frames_in_flight_max};
}

Micros FlowControl::rest(const Options& options) const {
  const Micros most = std::max(options.quiet_us, options.quiet_most_us);
  return std::clamp(link_.transfer(final_bytes_) / 2, options.quiet_us, most);
}

void FlowControl::sent(const Sent& frame, Micros now) {
  ++sent_seq_;
  writing_ = true;
  link_.sent({sent_seq_, frame.bytes, frame.begun, frame.moving}, now);
  if (frame.final) final_bytes_ = static_cast<double>(frame.bytes);
}

void FlowControl::written(Micros now) {
  writing_ = false;
  link_.written(now);
}

Result<void> FlowControl::acked(const protocol::AckMessage& message, Micros now) {
  if (message.seq > sent_seq_) {
    return make_error_at(ErrorKind::invalid, "/seq",
                         "was never sent; the newest frame is " + std::to_string(sent_seq_));
  }
  acked_seq_ = std::max(acked_seq_, message.seq);
  link_.acked(message.seq, message.decode_ms, now);
  return {};
}

}  // namespace windsplat::session
