// A netCDF file that is written quickly.
#pragma once

#include <string>

#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {

// A field `f` of 2 x 2 values: `first` and the three following numbers.
inline void write_small(const std::string& path, double first) {
  NetcdfMaker file(path);
  const int y = file.axis("lat", {0, 1}, "degrees_north");
  const int x = file.axis("lon", {0, 1}, "degrees_east");
  file.variable("f", NC_FLOAT, {y, x}, counting(4, first));
}

}  // namespace windsplat::data::test
