// The light of a view -> that of its scene, with the factors of its samples.
#pragma once

#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::light {

// Sets the light of a scene whose lattice, media, body and surfaces are known, and that of its body
// and isosurfaces, unless it is a slice, which is drawn unlit. media: identifies the field of each
// medium, with its step and level. The factors are computed once for the same media, lattice and
// sun, and kept, counted and evicted by the dataset like a level of a volume. Errors: invalid
// (/light); out_of_memory; not_resident.
Result<void> light_scene(const protocol::View& view, const std::vector<std::string>& media,
                         data::Dataset& dataset, scene::Scene& scene);

}  // namespace windsplat::light
