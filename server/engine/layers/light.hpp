// Scene -> the light of a pass.
#pragma once

#include "server/engine/plan.hpp"

namespace windsplat::engine {

// For a scene with light, whose factors must outlive the pass. The media of the pass are known.
void add_light(const scene::Scene& scene, PassPlan& pass);

}  // namespace windsplat::engine
