// What a region keeps -> the part of a placement, and the computation of the part of a field.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/place.hpp"
#include "server/scene/rates.hpp"
#include "server/scene/region/samples.hpp"

namespace windsplat::scene {

// Grid, lattice and ground of the part. Positions and cells are those of the whole; on a lattice
// that goes on beyond the end of the data, positions count on by 360 degrees. The box is that of
// the cells of the part; on a curved lattice, those at its sides have the edges of end cells.
Placed cropped_place(const std::shared_ptr<const Placed>& whole, const protocol::RegionView& region,
                     Crop crop);

// The rates of the whole at the samples of the part.
Rates cropped_rates(const Rates& rates, const Crop& crop);

// A field of that many components without what the region leaves out: the field itself if it
// leaves out nothing. `filters`: those that apply to it.
data::Derivation kept_part(const Placed& placed, std::size_t components,
                           const std::vector<protocol::FilterView>& filters);

// The second computation from the result of the first.
data::Derivation computed_from(const data::Derivation& first, data::Derivation second);

// Filters of the region that apply to lines, or to media.
std::vector<protocol::FilterView> filters_of(const protocol::RegionView& region,
                                             protocol::FilterOf of);

}  // namespace windsplat::scene
