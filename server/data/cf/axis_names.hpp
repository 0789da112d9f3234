// What names of dimensions and of their coordinates say, where a file has no attributes.
#pragma once

#include <string_view>

#include "server/data/cf/contents.hpp"
#include "server/data/cf/grid/axes.hpp"

namespace windsplat::data::cf {

// Strips the number that distinguishes grids of a file: "lat_0", "isobaric1", "gridx_6".
std::string_view without_number(std::string_view name);

// The role of a usual name in lower case.
Role role_of_name(std::string_view name);

// The coordinate of a dimension in space that none is named after: the only 1-D variable on it with
// a usual name, if both names have the same role, such as xh on ni of CM1, and z on nz. -1: there
// is none.
int named_coordinate(const FileContents& contents, int dimension);

}  // namespace windsplat::data::cf
