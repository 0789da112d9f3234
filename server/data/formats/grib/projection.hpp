// The map projection of a GRIB message, as a CF grid mapping, and its axes in metres.
#pragma once

#include "server/data/formats/grib/fields.hpp"
#include "server/data/formats/grib/message.hpp"

namespace windsplat::data::grib {

// Sets grid.projected, mapping, x and y of a grid with known type, rows and columns; or
// grid.problem. Templates 3.10, 3.12, 3.20, 3.30, 3.31 and 3.140 of edition 2, and their
// counterparts in edition 1.
void find_projection(const Message& message, Grid& grid);

}  // namespace windsplat::data::grib
