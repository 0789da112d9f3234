// The streamlets of a view <-> JSON tree.
#pragma once

#include <string>

#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

TraceView read_trace(const Json& json, const std::string& pointer, Faults& faults);
Json trace_to_json(const TraceView& trace);

}  // namespace windsplat::protocol
