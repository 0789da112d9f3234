// Inside the codec only: the shapes that REST, the stream and the command line share, as JSON
// trees.
#pragma once

#include "protocol/codec_json.hpp"
#include "protocol/messages.hpp"

namespace windsplat::protocol {

// limits.hpp, in camel case; of a picture's pixels the server's own limit.
Json limits_json(std::int64_t image_pixels_max);
Json problem_json(const Problem& problem);                     // RFC 9457
Json frame_info_json(const FrameInfo& info);                   // Windsplat-Frame
Json dataset_json(const DatasetDescription& dataset);          // the long form
Json dataset_summary_json(const DatasetDescription& dataset);  // the short form

}  // namespace windsplat::protocol
