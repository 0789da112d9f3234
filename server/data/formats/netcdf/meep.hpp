// HDF5 files of the field solver meep, whose dimensions have no names: names them x, y, z, t in
// FileContents.
#pragma once

#include "server/data/cf/contents.hpp"

namespace windsplat::data::netcdf {

// No effect unless every array has a name used by meep ("ex", "hz.r", "eps", ...) and all have the
// same two to four dimensions without names. meep's first index runs along x, and an unlimited last
// one along time: in netCDF's order, its vectors would be mirrored. Adds a note of the assumption.
void name_axes_of_meep(FileContents& contents);

}  // namespace windsplat::data::netcdf
