// The seeds of a view -> places among the samples.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/model/column_search.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/scene/place.hpp"
#include "server/trace/flow.hpp"

namespace windsplat::scene {

// Positions in the coordinates of the axes -> indices among the samples of a placed grid. Refers to
// what it is made from. Incomplete if cancelled.
class PlaceSearch {
 public:
  // `vertical`: the vertical axis of the data.
  PlaceSearch(const Placed& placed, const data::Axis& vertical, const CancelToken& cancel = {});

  // Linear between the samples; along an axis of one sample 0. Errors: invalid at `pointer`, with
  // the range of the data or of the region, if it is above or below all levels, or along
  // another axis more than half a cell outside; the text begins with `which`.
  [[nodiscard]] Result<glm::dvec3> index_of(const protocol::Vec3& at, const std::string& pointer,
                                            const std::string& which = "") const;

 private:
  const data::Grid& grid_;
  const data::Axis& vertical_;
  bool region_ = false;  // whether the grid is part of the data
  std::optional<data::ColumnSearch> columns_;
};

// Number of seeds that a view asks for together.
std::int64_t seeds_in(const protocol::SeedsView& seeds);

// All seeds of a view, in the order points, line, block, evenly. `flow`: steady, of the lattice.
// Errors: those of PlaceSearch::index_of() for points, lines and blocks; cancelled.
Result<std::vector<glm::dvec3>> seeds_of(const protocol::SeedsView& seeds, const Placed& placed,
                                         const data::Axis& vertical, const trace::Flow& flow,
                                         const CancelToken& cancel = {});

}  // namespace windsplat::scene
