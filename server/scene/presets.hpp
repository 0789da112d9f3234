// Named initial views.
#pragma once

#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// "default", "winds" (no medium), "clouds" (no lines), "top", "south", "figure" (the
// default camera, every annotation, and lines in the colours of the legend).
std::vector<std::string> preset_names();

// Changes a completed view's camera, annotations or colours of lines, or removes a kind of layer.
// Errors: invalid at /preset.
Result<void> apply_preset(protocol::View& completed, const Lattice& lattice,
                          const std::string& preset);

}  // namespace windsplat::scene
