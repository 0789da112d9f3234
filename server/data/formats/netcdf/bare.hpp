// Time steps of plain HDF5 files, whose dimensions have no names: marks the first of four
// dimensions as time in FileContents.
#pragma once

#include "server/data/cf/contents.hpp"

namespace windsplat::data::netcdf {

// Whether the netCDF library generated the dimension, for a file that has only arrays.
bool is_bare(const FileDimension& dimension);

// No effect if any dimension is named in the file. The first dimension of a 4-D array becomes a
// separate time dimension, unless it is unlimited (and hence time already) or the last one is short
// enough to be the components of a vector. Adds a note of the assumption.
void name_steps_of_bare_arrays(FileContents& contents);

}  // namespace windsplat::data::netcdf
