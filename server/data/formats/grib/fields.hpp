// Metadata of one GRIB message, and its values in the order of rows and columns.
// Everything of ecCodes happens here, under one lock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data::grib {

struct Grid {
  std::string type;     // ecCodes' gridType
  std::string problem;  // why it is not read; empty if it is
  std::size_t columns = 0;
  std::size_t rows = 0;
  bool projected = false;     // then one longitude and latitude a point, otherwise an axis each
  bool columns_fall = false;  // of a projected grid: scanned against growing i
  bool rows_fall = false;     // against growing j
  std::vector<double> longitude;
  std::vector<double> latitude;
};

struct Header {
  std::string short_name;
  std::string name;
  std::string standard_name;
  std::string units;
  std::string level_type;
  double level = 0;
  double hours = 0;  // of validity, since 1970-01-01
  bool relative_to_grid = false;
  std::string grid_key;  // equal for fields whose grid definitions have the same bytes
};

// Errors: bad_data, a clause without a subject.
Result<Header> read_header(const std::vector<unsigned char>& message);
Result<Grid> read_grid(const std::vector<unsigned char>& message);
// rows x columns, the columns fastest, in the order of the grid's coordinates; NaN where missing.
Result<std::vector<float>> read_values(const std::vector<unsigned char>& message, const Grid& grid);

}  // namespace windsplat::data::grib
