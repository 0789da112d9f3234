// The kernel profile K: its formula, and a table of it.
#include "server/engine/reference/profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "server/engine/reference/kernels.hpp"
#include "server/engine/reference/reference.hpp"

namespace windsplat::engine::reference {

namespace {

constexpr double s = footprint_s;
constexpr double t = footprint_t;
// Upper end of a = sqrt(t^2 - r^2) for r in [s, t].
const double outer_end = std::sqrt(t * t - s * s);

double inner_by(double b) {
  const double a = std::sqrt(t * t - s * s + b * b);
  return (2 * b / (s * t) + 2 / (t * (t - s)) * (t * std::log((t + a) / (s + b)) - (a - b))) /
         std::numbers::pi;
}

// t ln((t + a) / r) = t atanh(a / t), which is accurate near r = t.
double outer_by(double a) {
  return 2 / (std::numbers::pi * t * (t - s)) * (t * std::atanh(a / t) - a);
}

// Newton interpolation at Chebyshev nodes of x in [0, 1], converted to powers of x.
template <std::size_t N, class F>
void fit(const F& f, double from, double width, double (&power)[N]) {
  std::array<double, N> x{};
  std::array<double, N> d{};
  for (std::size_t j = 0; j < N; ++j) {
    x[j] = 0.5 - 0.5 * std::cos(std::numbers::pi * (static_cast<double>(j) + 0.5) / N);
    d[j] = f(from + width * x[j]);
  }
  for (std::size_t k = 1; k < N; ++k) {
    for (std::size_t j = N - 1; j >= k; --j) d[j] = (d[j] - d[j - 1]) / (x[j] - x[j - k]);
  }
  std::fill(std::begin(power), std::end(power), 0.0);
  for (std::size_t k = N; k-- > 0;) {
    for (std::size_t j = N - 1; j > 0; --j) power[j] = power[j - 1] - x[k] * power[j];
    power[0] = d[k] - x[k] * power[0];
  }
}

}  // namespace

double kernel_3d(double r) {
  const double x = std::abs(r);
  if (!(x < t)) return 0;
  return x < s ? inner_by(std::sqrt(s * s - x * x)) : outer_by(std::sqrt(t * t - x * x));
}

Profile::Profile()
    : cells_(inner_cells + outer_cells),
      inner_scale_(inner_cells / s),
      outer_scale_(outer_cells / outer_end) {
  for (int i = 0; i < inner_cells; ++i) {
    const double width = s / inner_cells;
    fit(inner_by, i * width, width, cells_[i].c);
  }
  for (int i = 0; i < outer_cells; ++i) {
    const double width = outer_end / outer_cells;
    fit(outer_by, i * width, width, cells_[inner_cells + i].c);
  }
}

}  // namespace windsplat::engine::reference
