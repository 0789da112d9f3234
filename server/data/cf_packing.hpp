// Stored number -> physical value, or NaN where the file says there is none (CF 1.8, 2.5.1
// and 8.1).
#pragma once

#include <limits>
#include <vector>

#include "server/data/netcdf_file.hpp"

namespace windsplat::data::cf {

struct Packing {
  bool packed = false;  // scale and offset apply; else a number passes untouched, -0 included
  double scale = 1;
  double offset = 0;
  double wrap = 0;              // added to negative stored numbers: a signed type that is unsigned
  std::vector<double> missing;  // stored numbers that mean "no value"
  double valid_min = -std::numeric_limits<double>::infinity();
  double valid_max = std::numeric_limits<double>::infinity();
  bool valid_is_unpacked = false;  // the limits are physical values, not stored numbers
};

// From _FillValue, missing_value, valid_min, valid_max, valid_range, scale_factor, add_offset and
// _Unsigned. Without a _FillValue the type's default fill counts as missing, but for 8-bit types.
Packing packing_of(const netcdf::File& file, int variable);

// value = stored * scale + offset; NaN if missing, invalid, or beyond float32.
float unpack(const Packing& packing, double stored);
// The same in double, for coordinates.
double unpack_double(const Packing& packing, double stored);

}  // namespace windsplat::data::cf
