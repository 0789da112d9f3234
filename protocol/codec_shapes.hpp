// Internal to the codec: documents shared by the HTTP API, the stream and the command line, as JSON
// trees.
#pragma once

#include "protocol/codec_json.hpp"
#include "protocol/messages.hpp"

namespace windsplat::protocol {

// The limits of limits.hpp in camel case; for pixels of a picture the limit of the server.
Json limits_json(const ServerLimits& server);
Json problem_json(const Problem& problem);                     // RFC 9457
Json frame_info_json(const FrameInfo& info);                   // Windsplat-Frame
Json dataset_json(const DatasetDescription& dataset);          // the long form
Json dataset_summary_json(const DatasetDescription& dataset);  // the short form

}  // namespace windsplat::protocol
