// Frame -> its report: the Windsplat-Frame header of REST and `chosen` of the stream.
#pragma once

#include "protocol/messages.hpp"
#include "server/frame/frame.hpp"

namespace windsplat::frame {

// `view` is the one that was drawn, completed or not.
protocol::FrameInfo frame_info(const Frame& frame, const protocol::View& view);

}  // namespace windsplat::frame
