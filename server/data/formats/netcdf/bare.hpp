// Steps of plain HDF5, whose arrays have bare dimensions: FileContents -> the same with the first
// of four dimensions named as time.
#pragma once

#include "server/data/cf/contents.hpp"

namespace windsplat::data::netcdf {

// Whether the netCDF library made the dimension up, for a file that has only arrays.
bool is_bare(const FileDimension& dimension);

// Does nothing where any dimension has a name of the file's. An array of four dimensions gets a
// time dimension of its own in place of its first one, unless that grows, which tells time by
// itself, or the last one is so short that it may count components. Leaves a note of what it did.
void name_steps_of_bare_arrays(FileContents& contents);

}  // namespace windsplat::data::netcdf
