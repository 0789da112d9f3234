// Two datasets on the same grid -> differences of their fields, sample by sample.
#pragma once

#include <string>

#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::data::derived {

// Whether samples of equal index are at the same place: axes of the same kind, units and
// coordinates, and equal columns. Coordinates may differ by the rounding of float: 1e-3 of the
// distance of neighbours. Errors: invalid, with the axis and values of `a` ("here") and of `b`.
Result<void> check_same_grid(const DatasetInfo& a, const DatasetInfo& b);

// Whether the field of `a` can be subtracted: `b` has one of that name, kind and number of
// components, in the same units (spelled differently or not). Errors: invalid; not_found if `a` has
// no such field.
Result<void> check_same_field(const std::string& field, const DatasetInfo& a, const DatasetInfo& b);

// a - b, of equal dimensions and components; samples that are masked in either are masked.
Volume subtract(const Volume& a, const Volume& b);

}  // namespace windsplat::data::derived
