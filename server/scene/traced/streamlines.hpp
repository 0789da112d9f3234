// View and fields -> the lines through the seeds of a scene.
#pragma once

#include <memory>
#include <string>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/place.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// `key`: of everything but the seeds on which lines depend. Paths load the vectors of their steps,
// all of which are in memory while they are followed. Errors: invalid at /vector/trace/seeds and
// below it (places outside of the data, more memory than the limit, paths without a time), those of
// loading, out_of_memory, not_resident.
Result<std::shared_ptr<const trace::Segments>> streamlines_of(
    const protocol::View& view, const Placed& placed, const VectorLayer& layer,
    const data::Derivation& how, const std::string& key, data::Dataset& dataset);

}  // namespace windsplat::scene
