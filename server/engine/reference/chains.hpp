// One segment of a curved line -> its line on the screen.
#pragma once

#include <cstddef>
#include <optional>

#include "server/engine/reference/kernels.hpp"

namespace windsplat::engine::reference {

// The segment from vertex `vertex` of the layer's streamlets to the next; empty if none begins
// there, or it lies before the near plane.
std::optional<Ribbon> make_segment(const scene::Scene& scene, const View& view,
                                   const scene::VectorLayer& layer, std::size_t vertex);

}  // namespace windsplat::engine::reference
