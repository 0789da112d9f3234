// Values of coordinate variables and coefficients: file -> physical numbers in double.
#pragma once

#include <optional>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

// All values of a small variable, unpacked, NaN where missing. Errors: bad_data.
Result<std::vector<double>> unpacked_values(const ArrayFile& file, int variable);

// The same for longitudes or latitudes, converted from any angular unit to degrees.
Result<std::vector<double>> unpacked_degrees(const ArrayFile& file, int variable);

// Whether numbers are equal or both NaN.
bool same_number(double a, double b);

// Whether coordinates are equal within single precision.
bool same_place(double a, double b);

// The times of a variable in the unit of another one, and how far they may be from the true ones.
struct RoundedTimes {
  std::vector<double> values;
  double rounding = 0;    // by storage as 32-bit floats, otherwise `exact`
  double exact = 0;       // by storage as doubles and by conversion between units
  double least_step = 0;  // infinite if there are less than two
};

// Empty if the unit of `from` cannot be converted to that of `to`.
std::optional<RoundedTimes> times_in(const std::vector<double>& values, const FileVariable& from,
                                     const FileVariable& to);

// How far apart equal times of both may lie: at most a tenth of the least step.
double time_tolerance(const RoundedTimes& a, const RoundedTimes& b);

}  // namespace windsplat::data::cf
