// A view that shows a difference: which handle yields its fields, and what is refused.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The handle that yields the fields of the view: of the dataset, or of its difference. `other`: the
// dataset that view.difference names; null: it names none. Errors: invalid at /difference/dataset
// (different grids), /difference/step, or /difference if it names nothing.
Result<data::Dataset> with_difference(const protocol::View& view, const data::Dataset& dataset,
                                      const data::Dataset* other);

// Whether the handle yields the fields of the view. Errors: invalid at /difference if it is not the
// handle of the view's difference, if a field that the view shows cannot be subtracted, or if what
// is subtracted has no step of that number.
Result<void> check_difference(const protocol::View& view, const data::Dataset& dataset);

// The step from whose values defaults follow: the first; of a difference the one that is farthest
// from the step subtracted, since defaults must not depend on the step shown.
std::size_t step_of_defaults(const data::Dataset& dataset);

// The last step that has values: of a difference at the same steps that of the dataset with fewer.
std::size_t last_step(const data::Dataset& dataset);

// Defaults of a scalar that is a difference: a diverging map over a range that is symmetric about
// zero, where a medium is transparent and a map (draws_map) is as opaque as elsewhere.
inline constexpr const char* difference_map = "coolwarm";
protocol::Range default_difference_range(const data::Volume& volume);
std::vector<std::array<double, 2>> default_difference_extinction(const data::FieldInfo& field,
                                                                 const protocol::Range& range,
                                                                 const Lattice& lattice,
                                                                 const std::optional<Slice>& slice,
                                                                 bool map);

}  // namespace windsplat::scene
