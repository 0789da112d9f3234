// Tabulates partial footprints.
#include "server/engine/partial.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

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

// The integral of K from the ray's middle to each of `count` + 1 even steps of its half chord, by
// Gauss's rule of two points on many pieces.
std::vector<double> integrals(double b2, int count) {
  constexpr int pieces = 32;  // a step
  const double chord = std::sqrt(std::max(t * t - b2, 0.0));
  const double h = chord / (count * pieces);
  const double node = 0.5 / std::sqrt(3.0);
  std::vector<double> sums{0.0};
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

std::vector<float> tabulate() {
  constexpr int rows = kernels::partial_rows;
  constexpr int columns = kernels::partial_columns;
  constexpr int half = (columns - 1) / 2;
  std::vector<float> table(static_cast<std::size_t>(rows) * columns);
  for (int r = 0; r < rows; ++r) {
    // The last row is the limit of the rays that graze the kernel.
    const double part = std::min(static_cast<double>(r) / (rows - 1), 1 - 1e-6);
    const std::vector<double> sums = integrals(t * t * part, half);
    for (int c = 0; c < columns; ++c) {
      const double from_middle = 0.5 * sums[std::abs(c - half)] / sums[half];
      table[static_cast<std::size_t>(r) * columns + c] =
          static_cast<float>(c < half ? 0.5 - from_middle : 0.5 + from_middle);
    }
  }
  return table;
}

}  // namespace

const std::vector<float>& partial_footprints() {
  static const std::vector<float> table = tabulate();
  return table;
}

}  // namespace windsplat::engine
