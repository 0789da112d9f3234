// Finds faults of coordinates.
#include "server/data/model/axis_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace windsplat::data {

namespace {

constexpr double coordinate_max = 1e290;
constexpr double step_min = 1e-290;
constexpr double share_min = 1e-18;  // the square of share_min is still a finite float
constexpr double rounding = 8 * std::numeric_limits<double>::epsilon();

}  // namespace

std::string axis_fault(const std::vector<double>& at) {
  if (at.empty()) return "has no coordinates";
  for (const double value : at) {
    if (!std::isfinite(value)) return "has missing values";
    if (std::abs(value) > coordinate_max) return "has coordinates beyond 1e290";
  }
  const bool rises = at.back() > at.front();
  const double least = std::max(step_min, share_min * std::abs(at.back() - at.front()));
  for (std::size_t i = 1; i < at.size(); ++i) {
    const double step = rises ? at[i] - at[i - 1] : at[i - 1] - at[i];
    if (!(step > 0)) return "is not strictly monotonic";
    if (step < least) return "has coordinates closer than 1e-290 or 1e-18 of its extent";
    if (step < rounding * std::max(std::abs(at[i]), std::abs(at[i - 1]))) {
      return "has coordinates closer than their rounding error";
    }
  }
  return {};
}

Result<void> check_axes(const Grid& grid) {
  for (const Axis& axis : grid.axes) {
    const std::string fault = axis_fault(axis.coordinates);
    if (!fault.empty()) {
      return make_error(ErrorKind::bad_data, "the axis " + in_quotes(axis.name) + ' ' + fault);
    }
  }
  return {};
}

}  // namespace windsplat::data
