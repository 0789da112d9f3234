// What a session asks of its surroundings, and what they answer, as plain values.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "protocol/frame_header.hpp"
#include "protocol/messages.hpp"
#include "protocol/view.hpp"

namespace windsplat::session {

using Payload = std::shared_ptr<const std::vector<std::uint8_t>>;

// How a frame's pixels are to be made and encoded.
struct Encoding {
  protocol::Codec codec = protocol::Codec::jpeg;
  int quality = 75;
  bool full_chroma = false;  // 4:4:4, else 4:2:0
  int level = 0;
};

struct SendText {
  protocol::ServerMessage message;
};
// Answered by Session::on_described with the same id. Loads fields: not for the caller's thread.
struct Describe {
  std::uint32_t id = 0;
  std::string dataset;
};
// Answered by Session::on_rendered with the same ticket, cancelled or not.
struct StartRender {
  std::uint64_t ticket = 0;
  protocol::View view;  // not completed; names its dataset
  Encoding encoding;
};
struct CancelRender {
  std::uint64_t ticket = 0;
};
// At most one is on its way: the next comes after Session::on_written.
struct SendFrame {
  protocol::FrameHeader header;
  Payload payload;
};
// The last effect of a session.
struct Close {
  int code = 1000;
  std::string reason;
};
using Effect = std::variant<SendText, Describe, StartRender, CancelRender, SendFrame, Close>;
using Effects = std::vector<Effect>;

// A frame as it was drawn.
struct Drawn {
  Payload payload;
  protocol::FrameInfo info;
  std::string view_json;  // the completed view, canonical
  std::int64_t queue_us = 0;
  std::int64_t render_us = 0;
  std::int64_t encode_us = 0;
  bool loaded =
      false;  // fields were read or averaged for it: its time says nothing of the next one's
};

}  // namespace windsplat::session
