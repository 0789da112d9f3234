// FileContents -> the dimensions besides space and time, of which one entry can be shown at a time.
#pragma once

#include <vector>

#include "server/data/cf/contents.hpp"
#include "server/data/cf/grid/axes.hpp"

namespace windsplat::data::cf {

struct ExtraDimensions {
  std::vector<int> chosen;  // dimension ids, in the order of the file
  // Lead or reference times of forecasts that are the time axis of their variables.
  std::vector<int> times;
};

// A dimension is chosen if variables with at least two spatial dimensions have it besides those and
// time: members of an ensemble; reference times besides lead times; where a variable has x and y
// and too many dimensions, the first ones of unknown role. Those in `fixed` (one per dimension) do
// not count. Lists of cells and corners of cells are never chosen, nor is an axis of another
// variable.
ExtraDimensions find_extra_dimensions(const FileContents& contents, const std::vector<bool>& fixed);

// Whether a dimension contains the lead times of forecasts.
bool is_lead_time(const FileContents& contents, const std::vector<DimensionRole>& roles,
                  int dimension);

}  // namespace windsplat::data::cf
