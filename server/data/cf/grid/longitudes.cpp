#include "server/data/cf/grid/longitudes.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace windsplat::data::cf {

namespace {

bool is_monotonic(const std::vector<double>& values) {
  const auto never = [&](auto wrong) {
    return std::adjacent_find(values.begin(), values.end(), wrong) == values.end();
  };
  return never(std::less_equal<>()) || never(std::greater_equal<>());
}

}  // namespace

void continue_over_seam(std::vector<double>& longitudes) {
  constexpr double turn = 360;
  if (longitudes.size() < 2 || is_monotonic(longitudes)) return;
  std::vector<double> out = longitudes;
  double added = 0;
  for (std::size_t i = 1; i < out.size(); ++i) {
    const double step = longitudes[i] - longitudes[i - 1];
    if (std::abs(step) > turn / 2) added += step > 0 ? -turn : turn;
    out[i] += added;
  }
  if (is_monotonic(out) && std::abs(out.back() - out.front()) < turn) longitudes = std::move(out);
}

}  // namespace windsplat::data::cf
