// The ground of a view <-> JSON tree.
#pragma once

#include <string>

#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

GroundView read_ground(const Json& json, const std::string& pointer, Faults& faults);
Json ground_to_json(const GroundView& ground);

}  // namespace windsplat::protocol
