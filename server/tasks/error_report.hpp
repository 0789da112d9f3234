// The error report of a frame: measured, or estimated from the calibration tables.
#pragma once

#include "protocol/messages.hpp"
#include "server/frame/frame.hpp"
#include "server/quality/tables.hpp"

namespace windsplat::tasks {

// Scene signature and viewpoint of a frame drawn at a setting.
struct Observation {
  quality::SceneSignature signature;
  quality::Viewpoint viewpoint;
};
Observation observed_in(const frame::Frame& drawn, const quality::Setting& setting);

// Sets error and jpegError of the frame's report. Measured errors are stored in the tables, and
// what the view shows if it was described.
// `quality` and chroma are those of the JPEG; other formats have no jpegError.
void report_error(const frame::Frame& drawn, const Observation& observed,
                  const quality::Setting& setting, const frame::Encoding& encoding,
                  quality::Tables& tables, protocol::FrameInfo& info);

}  // namespace windsplat::tasks
