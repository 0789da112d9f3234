// The surfaces of a view <-> JSON tree.
#pragma once

#include <string>
#include <vector>

#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

std::vector<SurfaceView> read_surfaces(const Json& json, const std::string& pointer,
                                       Faults& faults);
Json surfaces_to_json(const std::vector<SurfaceView>& surfaces);

}  // namespace windsplat::protocol
