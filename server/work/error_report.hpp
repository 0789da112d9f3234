// What is told of a frame's error: as measured, or estimated from what is known of its style.
#pragma once

#include "protocol/messages.hpp"
#include "server/frame/frame.hpp"
#include "server/quality/tables.hpp"

namespace windsplat::net {

// Style and sight of a frame that was drawn of a view at a setting.
struct Observation {
  quality::SceneSignature signature;
  quality::Viewpoint viewpoint;
};
Observation observed_in(const frame::Frame& drawn, const quality::Setting& setting);

// Sets error and jpegError of the frame's report. What was measured goes into the tables. `quality`
// and chroma are the JPEG's; of another format nothing is said.
void report_error(const frame::Frame& drawn, const Observation& observed,
                  const quality::Setting& setting, const frame::Encoding& encoding,
                  quality::Tables& tables, protocol::FrameInfo& info);

}  // namespace windsplat::net
