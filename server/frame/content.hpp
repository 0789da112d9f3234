// Scene -> what determines the errors of its pictures, from a few thousand of its samples.
#pragma once

#include <optional>

#include "server/base/cancel.hpp"
#include "server/quality/content.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// The same for the same scene. At most 4096 samples with their neighbours, spread evenly over the
// drawn lattice, are projected onto a coarse grid of the picture and composited in order of depth,
// without the body; then pixels are tried (pixel_trials). Takes some 50 ms, with bounded work.
// Empty if cancelled.
std::optional<quality::Content> content_of(const scene::Scene& scene,
                                           const CancelToken& cancel = {});

}  // namespace windsplat::frame
