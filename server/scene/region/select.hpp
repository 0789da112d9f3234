// The region of a view + a grid -> the samples that it keeps.
#pragma once

#include <optional>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/scene/region/samples.hpp"

namespace windsplat::scene {

// Whether the region keeps only part of the grid, apart from its filters.
bool is_cropped(const protocol::RegionView& region);

// How many samples along x, on an axis of longitudes, go around the globe once; 0: not as many as
// that. A last sample 360 degrees beyond the first repeats it and does not count.
int samples_around(const data::Grid& grid);

// The smallest box of samples that holds those within the ranges and columns of the region.
// `around`: of a grid with a longitude and latitude for every column, Lattice::around. O(samples
// along the axes), for polygons and longitudes or latitudes of columns O(columns). Errors: invalid
// at /region/... (no sample is within; longitudes that the grid lacks).
Result<Crop> crop_of(const protocol::RegionView& region, const data::Grid& grid, int around);

}  // namespace windsplat::scene
