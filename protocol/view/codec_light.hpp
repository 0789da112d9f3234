// The light of a view <-> JSON tree.
#pragma once

#include <optional>
#include <string>

#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

LightView read_light(const Json& json, const std::string& pointer, Faults& faults);
Json light_to_json(const std::optional<LightView>& light);

}  // namespace windsplat::protocol
