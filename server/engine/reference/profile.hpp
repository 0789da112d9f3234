// The 3-D kernel K of a splat as a piecewise polynomial, for fast evaluation.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/engine/reference/kernels.hpp"

namespace windsplat::engine::reference {

// K is smooth in b = sqrt(s^2 - r^2) for r < s and in a = sqrt(t^2 - r^2) beyond, so each range is
// divided into intervals of equal width in that variable, with a polynomial through Chebyshev nodes
// in each. Absolute error below 1e-12 (verified by a test).
class Profile {
 public:
  Profile();

  // r2: squared distance in cells, not negative.
  [[nodiscard]] double operator()(double r2) const {
    constexpr double s2 = footprint_s * footprint_s;
    constexpr double t2 = footprint_t * footprint_t;
    const bool inside = r2 < s2;
    const double square = (inside ? s2 : t2) - r2;
    if (square <= 0) return 0;
    const double place = std::sqrt(square) * (inside ? inner_scale_ : outer_scale_);
    const int cell = std::min(static_cast<int>(place), (inside ? inner_cells : outer_cells) - 1);
    const double x = place - cell;
    const double* c = cells_[(inside ? 0 : inner_cells) + cell].c;
    const double x2 = x * x;
    const double low = (c[0] + c[1] * x) + (c[2] + c[3] * x) * x2;
    const double high = (c[4] + c[5] * x) + (c[6] + c[7] * x) * x2;
    return low + high * (x2 * x2);
  }

 private:
  static constexpr int degree = 7;
  static constexpr int inner_cells = 32;
  static constexpr int outer_cells = 128;
  struct Cell {
    double c[degree + 1];
  };
  std::vector<Cell> cells_;
  double inner_scale_ = 0;
  double outer_scale_ = 0;
};

}  // namespace windsplat::engine::reference
