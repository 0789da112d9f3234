// Values of coordinate variables and coefficients: file -> physical numbers in double.
#pragma once

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

// How far a time may be from one of these and be the same, where one is stored in single precision;
// at most a tenth of the least step.
double time_tolerance(const std::vector<double>& times);

}  // namespace windsplat::data::cf
