// View and fields -> the streamlets of a scene.
#pragma once

#include <cstddef>
#include <memory>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/place.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Whether lines follow the flow.
inline bool has_streamlets(const protocol::View& view) { return view.vector.trace.has_value(); }

// The streamlets of a layer whose fields are loaded, on the lattice of the whole data. Computed on
// first need, shared, counted and evicted like a level of a volume; what they depend on is their
// key. Errors: invalid at /vector/trace (more memory than the limit), out_of_memory, not_resident.
Result<std::shared_ptr<const trace::Segments>> streamlets_of(const protocol::View& view,
                                                             const Placed& placed,
                                                             const VectorLayer& layer,
                                                             data::Dataset& dataset);

}  // namespace windsplat::scene
