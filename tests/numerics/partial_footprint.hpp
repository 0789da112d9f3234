// Parts of the footprint, computed as integrals over the kernel.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include "server/engine/reference/reference.hpp"

namespace windsplat::test {

// Simpson's rule with nodes clustered at both ends; shares no code with what it tests.
inline double simpson(const std::function<double(double)>& f, double from, double to,
                      int steps = 4000) {
  double sum = 0;
  for (int i = 0; i <= steps; ++i) {
    const double w = static_cast<double>(i) / steps;
    const double weight = i == 0 || i == steps ? 1 : (i % 2 == 1 ? 4 : 2);
    sum += weight * f(from + (to - from) * w * w * (3 - 2 * w)) * 6 * w * (1 - w);
  }
  return sum * (to - from) / (3 * steps);
}

// The integral of K from minus infinity to z (in cells from the middle) along a line at distance b.
inline double partial_footprint(double b, double z) {
  constexpr double s = 0.48;  // radius at which the two formulas of K meet
  constexpr double t = 1.37;  // radius beyond which K is 0
  if (b >= t) return 0;
  const double end = std::sqrt(t * t - b * b);
  const double inner = b < s ? std::sqrt(s * s - b * b) : 0;
  double sum = 0;
  double from = -end;
  for (const double to : {-inner, inner, end}) {
    const double until = std::min(to, z);
    if (until > from) {
      sum += simpson([&](double u) { return engine::reference::kernel_3d(std::hypot(b, u)); }, from,
                     until);
    }
    from = to;
  }
  return sum;
}

}  // namespace windsplat::test
