// Axes of plain HDF5 by the field solver meep, whose arrays have bare dimensions: FileContents ->
// the same with dimensions named x, y, z, t.
#pragma once

#include "server/data/cf/contents.hpp"

namespace windsplat::data::netcdf {

// Does nothing unless every array is named as meep names its own ("ex", "hz.r", "eps", ...) and all
// have the same two to four dimensions, none of which has a name of the file's. meep's first index
// runs along x, and a growing last one along time: read as netCDF's order, its vectors would be
// mirrored. Leaves a note of what it did.
void name_axes_of_meep(FileContents& contents);

}  // namespace windsplat::data::netcdf
