// Errors of some pixels of a picture: composited in the order of method `kernel` and in slabs,
// against the exact order by depth.
#pragma once

#include <optional>
#include <vector>

#include "server/frame/light_changes.hpp"
#include "server/quality/content.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// `through`: samples that the picture shows.
std::optional<quality::Trials> pixel_trials(const scene::Scene& scene,
                                            const std::vector<RayThrough>& through);

}  // namespace windsplat::frame
