// View and fields -> the traced lines of a scene.
#pragma once

#include <cstddef>
#include <memory>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/place.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The streamlets of a layer whose fields are loaded, on the lattice of the whole data, or its lines
// through seeds. Computed on first need, shared, counted and evicted like a level of a volume; what
// they depend on is their key. `how`: that of the vectors of the layer. Errors: invalid at
// /vector/trace (more memory than the limit), out_of_memory, not_resident; those of
// streamlines_of().
Result<std::shared_ptr<const trace::Segments>> traced_of(const protocol::View& view,
                                                         const Placed& placed,
                                                         const VectorLayer& layer,
                                                         const data::Derivation& how,
                                                         data::Dataset& dataset);

}  // namespace windsplat::scene
