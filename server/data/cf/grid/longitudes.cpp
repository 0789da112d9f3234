#include "server/data/cf/grid/longitudes.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace windsplat::data::cf {

namespace {

constexpr double full_circle = 360;

bool is_monotonic(const std::vector<double>& values) {
  const auto never = [&](auto wrong) {
    return std::adjacent_find(values.begin(), values.end(), wrong) == values.end();
  };
  return never(std::less_equal<>()) || never(std::greater_equal<>());
}

}  // namespace

void continue_over_seam(std::vector<double>& longitudes) {
  if (longitudes.size() < 2 || is_monotonic(longitudes)) return;
  std::vector<double> out = longitudes;
  double added = 0;
  for (std::size_t i = 1; i < out.size(); ++i) {
    const double step = longitudes[i] - longitudes[i - 1];
    if (std::abs(step) > full_circle / 2) added += step > 0 ? -full_circle : full_circle;
    out[i] += added;
  }
  constexpr double closed =
      full_circle * (1 + 1e-6);  // the first one may be repeated; single precision
  if (is_monotonic(out) && std::abs(out.back() - out.front()) <= closed)
    longitudes = std::move(out);
}

std::vector<double> turned_near(std::vector<double> longitudes, const std::vector<double>& others) {
  if (longitudes.empty() || others.empty()) return longitudes;
  const double shift =
      full_circle * std::round((others.front() - longitudes.front()) / full_circle);
  for (double& longitude : longitudes) longitude += shift;
  return longitudes;
}

}  // namespace windsplat::data::cf
