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
#include "server/quality/setting.hpp"
#include "server/quality/view_traits.hpp"

namespace windsplat::session {

using Payload = std::shared_ptr<const std::vector<std::uint8_t>>;

// How a frame's pixels are to be made and encoded.
struct Encoding {
  protocol::Codec codec = protocol::Codec::jpeg;
  int quality = 75;
  bool full_chroma = false;  // 4:4:4, else 4:2:0
  bool measure = false;      // the error of the picture, and of its encoding
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
  protocol::View view;  // not completed; names its dataset; drawn by `setting`
  quality::Setting setting;
  Encoding encoding;
};
struct CancelRender {
  std::uint64_t ticket = 0;
};
// What a frame is for: `moving` and `rest` come while the view changes and before its final frame.
enum class Tier { moving, rest, final, still };
// Goes before what comes next, or not at all. Its pong is answered by Session::on_pong.
struct Ping {
  std::uint32_t seq = 0;  // of the frame that comes next
};
// At most one is on its way: the next comes after Session::on_written.
struct SendFrame {
  protocol::FrameHeader header;
  Payload payload;
  Tier tier = Tier::moving;
};
// The steps whose fields a view will probably need soon, the most urgent first; it takes the place
// of the wish before. None: nothing is wanted any more. Not answered.
struct Prefetch {
  protocol::View view;  // not completed; names its dataset unless there are no steps
  std::vector<int> steps;
  quality::Setting setting;  // that they will be drawn by
};
// The view rests: time to learn what each setting costs and errs for it. Not answered, and given up
// as soon as anything is to be drawn.
struct Calibrate {
  protocol::View view;  // not completed; names its dataset
};
// The last effect of a session.
struct Close {
  int code = 1000;
  std::string reason;
};
using Effect = std::variant<SendText, Describe, StartRender, CancelRender, Ping, SendFrame,
                            Prefetch, Calibrate, Close>;
using Effects = std::vector<Effect>;

// A frame as it was drawn.
struct Drawn {
  Payload payload;
  protocol::FrameInfo info;
  std::string view_json;              // the completed view, canonical
  quality::SceneSignature signature;  // of the view that was asked for, and where it is seen from
  quality::Viewpoint viewpoint;
  std::int64_t queue_us = 0;
  std::int64_t render_us = 0;
  std::int64_t measure_us = 0;  // the finer run
  std::int64_t encode_us = 0;
  bool loaded =
      false;  // fields were read or averaged for it: its time says nothing of the next one's
};

}  // namespace windsplat::session
