// Standard names of the components of vectors, by east and north or by rows and columns.
#pragma once

#include <string>
#include <string_view>

#include "server/data/cf/contents.hpp"

namespace windsplat::data::grib {

// "eastward_wind_gust" of "u-component of wind (gust)": a name in the pattern of CF for components
// that ecCodes describes but does not name as CF does. Empty if the text describes no component.
std::string component_name(std::string_view description);

// ecCodes names winds eastward and northward regardless of the flag of the message. Winds along the
// rows and columns of the grid are x and y in CF, and must not be rotated. Whether the name
// changed.
bool tell_by_grid(FileVariable& variable);

}  // namespace windsplat::data::grib
