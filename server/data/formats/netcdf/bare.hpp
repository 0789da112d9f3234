// Steps of plain HDF5, whose arrays have bare dimensions: FileContents -> the same with the first
// of four dimensions named as time.
#pragma once

#include "server/data/cf/contents.hpp"

namespace windsplat::data::netcdf {

// Whether the netCDF library generated the dimension, for a file that has only arrays.
bool is_bare(const FileDimension& dimension);

// No effect where any dimension is named in the file. The first dimension of a 4-D array becomes a
// separate time dimension, unless it is unlimited, and so already time, or the last one is so short
// that it may be the components. Adds a note of the assumption.
void name_steps_of_bare_arrays(FileContents& contents);

}  // namespace windsplat::data::netcdf
