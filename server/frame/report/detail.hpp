// The level of the data that a picture shows, and the error of one that is coarser than would
// suffice: the picture and those of the next two coarser levels -> quality::DetailError.
#pragma once

#include <optional>
#include <vector>

#include "protocol/messages.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/frame/frame.hpp"
#include "server/quality/detail_error.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

// Of data with stored levels.
std::optional<protocol::DetailReport> data_drawn(const scene::Scene& scene);

// Whether a coarser level was drawn than would suffice.
bool lacks_detail(const std::optional<protocol::DetailReport>& drawn);

// The scenes of the next two coarser levels, with whose pictures that of the scene is compared, the
// finer first. They are without lines if the scene has those of full detail, with a stride. Empty
// if there are not two coarser levels, or they cannot be read. Errors: not_resident, cancelled.
Result<std::vector<scene::Scene>> scenes_to_compare(const scene::CompletedView& completed,
                                                    const scene::Scene& scene,
                                                    data::Dataset& dataset);

// Of the picture in the workspace, which is kept. Empty if it is not known: there is nothing to
// compare the picture with. Errors: those of the engine.
Result<std::optional<quality::DetailError>> detail_error(const Prepared& prepared,
                                                         const data::Dataset& dataset,
                                                         ThreadPool& pool,
                                                         const CancelToken& cancel,
                                                         Workspace& workspace);

}  // namespace windsplat::frame
