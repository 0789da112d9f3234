// The mark of the lines of a view <-> JSON tree.
#pragma once

#include <string>

#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

MarkView read_mark(const Json& json, const std::string& pointer, Faults& faults);
Json mark_to_json(const MarkView& mark);

}  // namespace windsplat::protocol
