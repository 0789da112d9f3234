// Inside the codec only: the shapes that REST, the stream and the command line share, as JSON
// trees.
#pragma once

#include "protocol/codec_json.hpp"
#include "protocol/messages.hpp"

namespace windsplat::protocol {

Json limits_json();                                            // limits.hpp, in camel case
Json problem_json(const Problem& problem);                     // RFC 9457
Json frame_info_json(const FrameInfo& info);                   // Windsplat-Frame
Json dataset_json(const DatasetDescription& dataset);          // the long form
Json dataset_summary_json(const DatasetDescription& dataset);  // the short form

}  // namespace windsplat::protocol
