// Scene and work report -> why a picture shows nothing of the data.
#pragma once

#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/engine/work.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// The reasons that no sample of the data is drawn, one for each field of the view, as text: masked
// samples, thresholds of the view with the values that they exclude, the camera. Empty if the
// picture shows some. `view`: the completed view of the scene, of `dataset`. `surfaces`: why those
// of the scene have no triangles. `transparent`: no pixel was changed; known of the method
// reference, otherwise it follows from `work`.
std::string why_empty(const scene::Scene& scene, const protocol::View& view,
                      const data::Dataset& dataset, const std::vector<std::string>& surfaces,
                      const engine::WorkReport& work, bool transparent);

}  // namespace windsplat::frame
