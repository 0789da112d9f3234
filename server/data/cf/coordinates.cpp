// Reads whole variables, unpacks value by value and converts radians to degrees.
#include "server/data/cf/coordinates.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/packing.hpp"

namespace windsplat::data::cf {

Result<std::vector<double>> unpacked_values(const ArrayFile& file, int variable) {
  auto values = file.read_all(variable);
  if (!values) return values;
  const Packing packing = packing_of(file, variable);
  for (double& value : *values) value = unpack_double(packing, value);
  return values;
}

Result<std::vector<double>> unpacked_degrees(const ArrayFile& file, int variable) {
  auto values = unpacked_values(file, variable);
  if (values && is_radian(file.contents().variables.at(at(variable)).units)) {
    for (double& value : *values) value *= 180 / std::numbers::pi;
  }
  return values;
}

bool same_number(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool same_place(double a, double b) {
  return same_number(a, b) || std::abs(a - b) <= 1e-6 * std::max(std::abs(a), std::abs(b)) + 1e-9;
}

double time_tolerance(const std::vector<double>& times) {
  constexpr double rounding = static_cast<double>(std::numeric_limits<float>::epsilon());
  double largest = 0;
  double least_step = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < times.size(); ++i) {
    largest = std::max(largest, std::abs(times[i]));
    if (i > 0) least_step = std::min(least_step, std::abs(times[i] - times[i - 1]));
  }
  return std::min(rounding * largest + 1e-9, 0.1 * least_step);
}

}  // namespace windsplat::data::cf
