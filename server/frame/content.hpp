// Scene -> what determines the errors of its pictures, from a few thousand of its samples.
#pragma once

#include <cstdint>
#include <optional>

#include "server/base/cancel.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/quality/content.hpp"
#include "server/quality/tables.hpp"
#include "server/quality/view_traits.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// The same for the same scene. At most 4096 samples with their neighbours, spread evenly over the
// drawn lattice, are projected onto a coarse grid of the picture and composited in order of depth,
// without the body; then pixels are tried (pixel_trials). Takes some 50 ms, with bounded work.
// Empty if cancelled.
std::optional<quality::Content> content_of(const scene::Scene& scene,
                                           const CancelToken& cancel = {});

// Number of scenes described in this process: tests compare it with the number of views.
std::uint64_t descriptions();

// What views show is found once for each: completed view + tables -> viewpoint with content.
struct Described {
  quality::Viewpoint viewpoint;  // without content: its data are not resident, or cancelled
  std::int64_t describe_us = 0;  // 0: nothing was described
};

// The viewpoint of a completed view, with its content if the tables know it.
quality::Viewpoint known_viewpoint_of(const scene::CompletedView& completed,
                                      quality::Tables& tables);

// The same. If the content is unknown, the scene is described, and the tables keep what it shows.
Described described(const scene::CompletedView& completed, const scene::Scene& scene,
                    quality::Tables& tables, const CancelToken& cancel);
// Builds the scene only if it is needed, from resident data.
Described described(const scene::CompletedView& completed, const data::Dataset& dataset,
                    quality::Tables& tables, const CancelToken& cancel);

}  // namespace windsplat::frame
