// Metres between samples, from the reader -> horizontal axes without coordinates.
#pragma once

#include <array>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/read_blocks.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

// Gives axes in metres to a grid without positions whose dimensions have FileDimension::spacing_m,
// unless the map factors of WRF (MAPFAC_M, lengths in the plane by lengths on the Earth) differ
// from 1 by more than a thousandth, where lengths in the plane are not those of the flow.
// coordinates: variables of x and y, -1: none. Errors: bad_data.
Result<void> place_in_plane(const ArrayFile& file, const Placement& grid,
                            const std::array<int, 2>& coordinates, DatasetInfo& info);

}  // namespace windsplat::data::cf
