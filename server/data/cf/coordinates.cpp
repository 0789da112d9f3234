// Reads whole variables, unpacks value by value and converts radians to degrees.
#include "server/data/cf/coordinates.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/packing.hpp"
#include "server/data/cf/time.hpp"

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

std::optional<RoundedTimes> times_in(const std::vector<double>& values, const FileVariable& from,
                                     const FileVariable& to) {
  const TimeUnits own{from.units, from.calendar};
  const TimeUnits wanted{to.units, to.calendar};
  auto converted = convert_times(values, own, wanted);
  if (!converted) return std::nullopt;
  RoundedTimes out;
  out.least_step = std::numeric_limits<double>::infinity();
  double largest = 0;  // from the epoch of `from`
  double conversion = 0;
  if (from.units != to.units) {
    const auto epoch = convert_times({0}, own, wanted);
    if (epoch) largest = std::abs(epoch->front());
    const std::size_t since = to.units.find(" since ");
    if (since != std::string::npos) {
      const TimeUnits seconds{"seconds" + to.units.substr(since), to.calendar};
      const auto second = convert_times({0, 1}, seconds, wanted);
      if (second) conversion = 1e-3 * std::abs(second->back() - second->front());
    }
  }
  double most = 0;
  for (std::size_t i = 0; i < converted->size(); ++i) {
    most = std::max(most, std::abs((*converted)[i]));
    if (i > 0) {
      out.least_step = std::min(out.least_step, std::abs((*converted)[i] - (*converted)[i - 1]));
    }
  }
  largest += most;
  out.exact = 1e-12 * largest + conversion;
  constexpr auto single = static_cast<double>(std::numeric_limits<float>::epsilon());
  out.rounding = out.exact + (from.type == "float32" ? single * largest : 0);
  out.values = std::move(*converted);
  return out;
}

double time_tolerance(const RoundedTimes& a, const RoundedTimes& b) {
  return std::min(a.rounding + b.rounding, 0.1 * std::min(a.least_step, b.least_step));
}

}  // namespace windsplat::data::cf
