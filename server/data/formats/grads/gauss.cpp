// Newton's method with the three-term recurrence of Legendre polynomials.
#include "server/data/formats/grads/gauss.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace windsplat::data::grads {

std::vector<double> gaussian_latitudes(int count) {
  std::vector<double> out;
  for (int k = count; k >= 1; --k) {
    double x = std::cos(std::numbers::pi * (k - 0.25) / (count + 0.5));
    for (int round = 0; round < 8; ++round) {
      double before = 1;
      double here = x;
      for (int n = 2; n <= count; ++n) {
        const double next = ((2 * n - 1) * x * here - (n - 1) * before) / n;
        before = here;
        here = next;
      }
      const double slope = count * (x * here - before) / (x * x - 1);
      x -= here / slope;
    }
    out.push_back(std::asin(x) * 180 / std::numbers::pi);
  }
  return out;
}

}  // namespace windsplat::data::grads
