// The region of a view <-> JSON tree.
#pragma once

#include <string>

#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

RegionView read_region(const Json& json, const std::string& pointer, Faults& faults);
Json region_to_json(const RegionView& region);

}  // namespace windsplat::protocol
