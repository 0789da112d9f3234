// What happens on the WebSocket of a session, apart from its end.
#pragma once

#include <string>
#include <string_view>

namespace windsplat::transport {

class StreamEvents {
 public:
  StreamEvents() = default;
  virtual ~StreamEvents() = default;
  StreamEvents(const StreamEvents&) = delete;
  StreamEvents& operator=(const StreamEvents&) = delete;

  virtual void on_text(const std::string& text) = 0;
  virtual void on_binary() = 0;
  virtual void on_pong(std::string_view payload) = 0;
  virtual void on_frame_written() = 0;
  // A result of the session's work could not be posted: the session would wait forever.
  [[nodiscard]] virtual bool has_lost_reply() const = 0;
};

}  // namespace windsplat::transport
