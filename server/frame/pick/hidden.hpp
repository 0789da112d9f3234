// Places in the world -> whether something opaque hides them in the picture.
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// For each place: whether surfaces that absorb more than half of the light, or the body, lie before
// it, nearer by more than two pixels at its depth; or whether it does not lie before the eye. Lines
// and media hide nothing. Passes once over the triangles of all surfaces. Not all if cancelled.
std::vector<bool> hidden_places(const scene::Scene& scene, const std::vector<glm::dvec3>& places,
                                const CancelToken& cancel = {});

}  // namespace windsplat::frame
