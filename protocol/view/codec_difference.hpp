// The difference that a view shows <-> JSON tree.
#pragma once

#include <optional>
#include <string>

#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

DifferenceView read_difference(const Json& json, const std::string& pointer, Faults& faults);
Json difference_to_json(const std::optional<DifferenceView>& difference);  // null: none

}  // namespace windsplat::protocol
