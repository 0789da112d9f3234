#include "server/transport/websocket/message_meter.hpp"

#include <algorithm>

#include "protocol/limits.hpp"

namespace windsplat::transport {
namespace {

// Bytes on the wire for one message: text and frame headers.
constexpr std::size_t wire_bytes_max = 2 * protocol::limits::message_bytes_max;
constexpr int controls_max = 10000;                  // pings and pongs between two checks
constexpr std::chrono::seconds message_timeout{10};  // from the first byte

}  // namespace

void MessageMeter::heard_whole() {
  control_bytes_ = 0;
  since_.reset();
}

// The control frame may have arrived between fragments of a message. Some of its bytes may have
// been read, and discounted, with the previous message.
bool MessageMeter::heard_control(std::size_t payload_bytes, std::size_t bytes_read) {
  constexpr std::size_t head_bytes = 6;  // header with mask
  control_bytes_ = std::min(control_bytes_ + head_bytes + payload_bytes, bytes_read);
  return ++controls_ != controls_max;
}

MessageMeter::Verdict MessageMeter::check(std::size_t bytes_read, Clock::time_point now) {
  controls_ = 0;
  const std::size_t bytes = bytes_read - control_bytes_;
  if (bytes == 0) since_.reset();
  if (bytes > 0 && !since_) since_ = now;
  if (since_ && now - *since_ > message_timeout) return Verdict::too_slow;
  return bytes > wire_bytes_max ? Verdict::too_long : Verdict::fine;
}

}  // namespace windsplat::transport
