// Limits on an incoming message that the WebSocket layer does not enforce. That layer does not
// report a message that never ends, sent as empty fragments or byte by byte; this class counts the
// bytes since the last complete message, less control frames.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>

namespace windsplat::transport {

class MessageMeter {
 public:
  using Clock = std::chrono::steady_clock;
  enum class Verdict { fine, too_slow, too_long };

  void heard_whole();
  // `bytes_read`: received since the last complete message. False: it was the last control frame
  // allowed between two checks.
  bool heard_control(std::size_t payload_bytes, std::size_t bytes_read);
  // Call about once a second.
  Verdict check(std::size_t bytes_read, Clock::time_point now);

 private:
  std::size_t control_bytes_ = 0;           // control frames since the last message
  std::optional<Clock::time_point> since_;  // first bytes of an incomplete message
  int controls_ = 0;                        // control frames since the last check
};

}  // namespace windsplat::transport
