// Tabulation of partial footprints.
#include "server/engine/partial.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "server/engine/kernels/frame_data.hpp"

namespace windsplat::engine {

namespace {

constexpr double s = 0.48;
constexpr double t = 1.37;

// pi K(r) / 2, without the constant factors that cancel in the ratio.
double kernel_at(double r) {
  if (r >= t) return 0;
  const double a = std::sqrt(t * t - r * r);
  if (r >= s) return (t * std::log((t + a) / r) - a) / (t * (t - s));
  const double b = std::sqrt(s * s - r * r);
  return b / (s * t) + (t * std::log((t + a) / (s + b)) - (a - b)) / (t * (t - s));
}

// The integral of K from the middle of the ray to each of `count` + 1 equidistant points of its
// half chord, by composite two-point Gauss quadrature.
std::vector<double> integrals(double b2, int count) {
  constexpr int pieces = 32;  // pieces per step
  const double chord = std::sqrt(std::max(t * t - b2, 0.0));
  const double h = chord / (count * pieces);
  const double node = 0.5 / std::sqrt(3.0);
  std::vector<double> sums;
  sums.reserve(static_cast<std::size_t>(count) + 1);
  sums.push_back(0.0);
  double sum = 0;
  for (int step = 0; step < count; ++step) {
    for (int piece = 0; piece < pieces; ++piece) {
      const double middle = (step * pieces + piece + 0.5) * h;
      for (const double side : {-node, node}) {
        const double u = middle + side * h;
        sum += 0.5 * h * kernel_at(std::sqrt(b2 + u * u));
      }
    }
    sums.push_back(sum);
  }
  return sums;
}

// F at the columns of one row, in units of 1 / partial_one.
std::vector<std::uint32_t> row_of(double b2) {
  constexpr int half = (kernels::partial_columns - 1) / 2;
  const std::vector<double> sums = integrals(b2, half);
  std::vector<std::uint32_t> out;
  out.reserve(kernels::partial_columns);
  for (int c = -half; c <= half; ++c) {
    const double from_middle = 0.5 * sums[std::abs(c)] / sums[half];
    const double before = c < 0 ? 0.5 - from_middle : 0.5 + from_middle;
    out.push_back(static_cast<std::uint32_t>(std::lround(before * kernels::partial_one)));
  }
  return out;
}

std::vector<std::int32_t> tabulate() {
  constexpr int rows = kernels::partial_rows;
  std::vector<std::int32_t> table;
  table.reserve(static_cast<std::size_t>(rows) * (kernels::partial_columns - 1));
  for (int r = 0; r < rows; ++r) {
    // The last row is the limit of rays tangent to the kernel.
    const double part = std::min(static_cast<double>(r) / (rows - 1), 1 - 1e-6);
    const std::vector<std::uint32_t> row = row_of(t * t * part);
    for (std::size_t c = 0; c + 1 < row.size(); ++c) {
      table.push_back(static_cast<std::int32_t>(row[c] | row[c + 1] << 16U));
    }
  }
  return table;
}

}  // namespace

const std::vector<std::int32_t>& partial_footprints() {
  static const std::vector<std::int32_t> table = tabulate();
  return table;
}

}  // namespace windsplat::engine
