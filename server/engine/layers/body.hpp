// The body of a scene -> the input of the kernels.
#pragma once

#include "server/engine/kernels/frame_data.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::engine {

// The shape is body_none if the scene has no body. Refers to the terrain of the scene.
kernels::Body make_body(const scene::Scene& scene);

}  // namespace windsplat::engine
