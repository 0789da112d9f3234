// Metadata of one GRIB message, and its values in the order of rows and columns. All calls to
// ecCodes are made here, under one lock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/grid/projection.hpp"
#include "server/data/formats/grib/products.hpp"

namespace windsplat::data::grib {

struct Grid {
  std::string type;     // gridType of ecCodes
  std::string problem;  // why it cannot be read; empty if it can
  std::size_t columns = 0;
  std::size_t rows = 0;
  // Projected: x and y in metres are the axes; otherwise longitude and latitude.
  bool projected = false;
  std::vector<double> x;  // in the order of columns and rows
  std::vector<double> y;
  std::vector<double> longitude;
  std::vector<double> latitude;
  std::vector<std::size_t> row_lengths;  // points of each row of a reduced grid, the longest having
                                         // `columns`; empty for other grids
  bool rotated = false;                  // longitudes and latitudes relate to a rotated pole
  cf::GridMapping mapping;               // of projected and rotated grids, as in CF
  // Cells in a list (template 3.101), in one row of `columns`, whose positions are elsewhere.
  bool is_list = false;
  std::string uuid;  // of the horizontal grid: 32 hexadecimal digits
};

struct Header {
  std::string short_name;
  std::string level_type;
  double level = 0;      // levels.hpp
  double hours = 0;      // time of validity, since 1970-01-01
  double reference = 0;  // reference time, likewise
  double member = 0;     // number in an ensemble; 0: the control, or no ensemble
  bool relative_to_grid = false;
  Product product;
  std::string grid_key;  // equal for fields whose grid definitions have the same bytes
};

// Hours since 1970-01-01 of YYYYMMDD and HHMM; NaN if they are not a date and a time.
double hours_of(long date, long time);

// Of a quantity, with its units. ecCodes takes longer for these than for a Header.
struct Names {
  std::string name;
  std::string standard_name;
  std::string units;
};

// Errors: bad_data; the message is a predicate without subject.
Result<Header> read_header(const std::vector<unsigned char>& message);
Result<Names> read_names(const std::vector<unsigned char>& message);
// The coefficients of vertical coordinates, `pv` of ecCodes; empty if there are none.
Result<std::vector<double>> read_coefficients(const std::vector<unsigned char>& message);
Result<Grid> read_grid(const std::vector<unsigned char>& message);
// values of rows x columns, columns fastest, in the order of the coordinates of the grid; NaN if
// missing; of a reduced grid, interpolated along its rows
Result<std::vector<float>> read_values(const std::vector<unsigned char>& message, const Grid& grid);

}  // namespace windsplat::data::grib
