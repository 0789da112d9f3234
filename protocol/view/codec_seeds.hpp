// The seeds of traced lines <-> JSON tree.
#pragma once

#include <string>

#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

SeedsView read_seeds(const Json& json, const std::string& pointer, Faults& faults);
Json seeds_to_json(const SeedsView& seeds);

}  // namespace windsplat::protocol
