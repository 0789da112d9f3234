// Lists of positions that are no cells of one picture.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

// Positions at different times are no picture of one: tracks of ships, profiles of floats. list: a
// dimension. Errors: bad_data if different times lie along it, or a cf_role trajectory_id or
// profile_id (CF 1.11, 9.5); those of reading.
Result<void> check_one_time(const ArrayFile& file, int list);

// Whether longitudes and latitudes said to be in degrees fill those of a globe in radians.
bool are_radians(const std::array<std::vector<double>, 2>& positions);

// Whether the text names no unit of an angle: empty, "1" or "-".
bool is_unitless(std::string_view units);

// Longitudes and latitudes without units are degrees unless they could be radians, too, both or
// one beside radians, which is not guessed. variables: of the longitudes and latitudes, or their
// bounds, which have the units of their coordinate (CF 1.11, 7.1). Errors: bad_data.
Result<void> check_units(const FileContents& contents, const std::array<int, 2>& variables,
                         const std::array<std::vector<double>, 2>& positions);

}  // namespace windsplat::data::cf
