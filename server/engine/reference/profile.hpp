// The splat's kernel in space, K, for many evaluations: a table of polynomials.
#pragma once

#include <vector>

namespace windsplat::engine::reference {

// K is smooth in b = sqrt(s^2 - r^2) inside s and in a = sqrt(t^2 - r^2) outside of it, so each has
// cells of equal width there, with a polynomial through Chebyshev nodes in each. Absolute error
// below 1e-12 (proven by a test).
class Profile {
 public:
  Profile();

  // r2: the square of a distance in cells, not negative.
  [[nodiscard]] double operator()(double r2) const;

 private:
  static constexpr int degree = 7;
  struct Cell {
    double c[degree + 1];
  };
  std::vector<Cell> cells_;
};

}  // namespace windsplat::engine::reference
