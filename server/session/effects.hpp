// Requests of a session to its environment and their results, as plain values.
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
#include "server/quality/sizes.hpp"
#include "server/quality/view_traits.hpp"

namespace windsplat::session {

using Payload = std::shared_ptr<const std::vector<std::uint8_t>>;

// How to render and encode a frame.
struct Encoding {
  protocol::Codec codec = protocol::Codec::jpeg;
  int quality = 75;
  bool full_chroma = false;  // 4:4:4, else 4:2:0
  bool measure = false;      // the error of the picture, and of its encoding
  bool key = false;          // of H.264: without reference to an earlier frame
};

struct SendText {
  protocol::ServerMessage message;
};
// Answered by Session::on_described with the same id. Loads fields: do not run on the caller's
// thread.
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
  // Whether coarser data may stand in for those that are not in memory, so that it does not wait.
  bool may_stand_in = false;
};
// No further frame of H.264 until one with `key`: the encoder is no longer needed.
struct EndVideo {};
struct CancelRender {
  std::uint64_t ticket = 0;
};
// Purpose of a frame: `moving` and `rest` precede the final frame, during and after a change.
enum class Tier { moving, rest, final, still };
// Sent directly before the next message or not at all. The pong calls Session::on_pong.
struct Ping {
  std::uint32_t seq = 0;  // number of the next frame
};
// At most one frame is being written: the next one follows Session::on_written().
struct SendFrame {
  protocol::FrameHeader header;
  Payload payload;
  Tier tier = Tier::moving;
  bool stands_in = false;  // coarser data than wanted are drawn, until those are in memory
};
// The steps whose fields a view will probably need soon, most urgent first; replaces the previous
// request. None: withdraws it. Not answered.
struct Prefetch {
  protocol::View view;  // not completed; names its dataset unless there are no steps
  std::vector<int> steps;
  quality::Setting setting;  // setting with which they will be drawn
};
// The client hides the picture: what moving frames asked for need not be loaded, nor stay in
// memory.
struct Hide {};
// The view is at rest: measure time and error of each setting for it. Not answered; cancelled by
// the next render, and sent again after the last of the stills.
struct Calibrate {
  protocol::View view;  // not completed; names its dataset
};
// The last effect of a session.
struct Close {
  int code = 1000;
  std::string reason;
};
using Effect = std::variant<SendText, Describe, StartRender, EndVideo, CancelRender, Ping,
                            SendFrame, Prefetch, Hide, Calibrate, Close>;
using Effects = std::vector<Effect>;

// A rendered frame.
struct Drawn {
  Payload payload;
  bool video = false;  // H.264; otherwise, though asked for, JPEG
  bool key = false;    // of H.264
  protocol::FrameInfo info;
  std::string view_json;              // the completed view, canonical
  quality::SceneSignature signature;  // signature of the requested view, with its viewpoint
  quality::Viewpoint viewpoint;
  quality::Halvings halvings{};  // of the data, by the size of the picture
  std::int64_t queue_us = 0;
  std::int64_t render_us = 0;
  std::int64_t measure_us = 0;  // time of the finer rendering
  std::int64_t encode_us = 0;
  bool loaded =
      false;  // fields were read or averaged for it: its time does not predict that of the next one
};

}  // namespace windsplat::session
