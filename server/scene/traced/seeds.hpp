// The seeds of a view -> places among the samples.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/scene/place.hpp"
#include "server/trace/flow.hpp"

namespace windsplat::scene {

// A position in the coordinates of the axes as an index among the samples of a placed grid, linear
// between them; along an axis of one sample 0. `vertical`: the vertical axis of the data. Errors:
// invalid at `pointer`, with the range of the data, if it is more than half a cell outside.
Result<glm::dvec3> index_of(const protocol::Vec3& at, const Placed& placed,
                            const data::Axis& vertical, const std::string& pointer);

// Number of seeds that a view asks for together.
std::int64_t seeds_in(const protocol::SeedsView& seeds);

// All seeds of a view, in the order points, line, block, evenly. `flow`: steady, of the lattice.
// Errors: those of index_of() for points and the ends of lines and blocks.
Result<std::vector<glm::dvec3>> seeds_of(const protocol::SeedsView& seeds, const Placed& placed,
                                         const data::Axis& vertical, const trace::Flow& flow);

}  // namespace windsplat::scene
