// A small mesh for tests: quadrilaterals of size 1, whose corners and values are known.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "tests/unit/data/dataset_probe.hpp"

namespace windsplat::data::test::mesh {

using Function = std::function<double(double, double)>;
using Table = std::vector<double>;

inline constexpr std::size_t columns =
    6;  // of quadrilaterals of size 1; 4 rows; x from 10, y from 40
inline constexpr std::size_t rows = 4;
inline constexpr std::size_t cells = columns * rows;
inline constexpr std::size_t nodes = (columns + 1) * (rows + 1);

inline double node_x(std::size_t n) { return 10 + static_cast<double>(n % (columns + 1)); }
inline double node_y(std::size_t n) { return 40 + static_cast<double>(n / (columns + 1)); }
inline double cell_x(std::size_t c) { return 10.5 + static_cast<double>(c % columns); }
inline double cell_y(std::size_t c) { return 40.5 + static_cast<double>(c / columns); }

// Corners of each cell, numbered from `first`.
inline Table corners(double first) {
  Table out;
  for (std::size_t c = 0; c < cells; ++c) {
    const auto low = static_cast<double>(c / columns * (columns + 1) + c % columns);
    for (const double corner : {low, low + 1, low + columns + 2, low + columns + 1}) {
      out.push_back(corner + first);
    }
  }
  return out;
}

inline Table with_padding(const Table& four, double fill) {
  Table out;
  for (std::size_t i = 0; i < four.size(); ++i) {
    out.push_back(four[i]);
    if (i % 4 == 3) out.insert(out.end(), {fill, fill});
  }
  return out;
}

inline Table turned(const Table& table, std::size_t width) {
  Table out;
  for (std::size_t i = 0; i < width; ++i) {
    for (std::size_t c = i; c < table.size(); c += width) out.push_back(table[c]);
  }
  return out;
}

inline Table at_nodes(const Function& f) {
  Table out;
  for (std::size_t n = 0; n < nodes; ++n) out.push_back(f(node_x(n), node_y(n)));
  return out;
}
inline Table at_cells(const Function& f) {
  Table out;
  for (std::size_t c = 0; c < cells; ++c) out.push_back(f(cell_x(c), cell_y(c)));
  return out;
}

inline double sum_of(double x, double y) { return x + 10 * y; }

// Whether every sample of a field of one layer is f, except those within `rim` of the edge, or
// masked.
inline void expect_function(Source& source, const std::string& name, const Function& f,
                            double rim = 0, std::size_t layer = 0) {
  const Volume volume = volume_of(source, name);
  const auto& axes = source.info().grid.axes;
  const std::size_t width = axes[0].coordinates.size();
  const std::size_t height = axes[1].coordinates.size();
  ASSERT_GT(width * height, 500U);
  std::size_t compared = 0;
  for (std::size_t j = 0; j < height; ++j) {
    for (std::size_t i = 0; i < width; ++i) {
      const double x = axes[0].coordinates[i];
      const double y = axes[1].coordinates[j];
      if (x < 10 + rim || x > 16 - rim || y < 40 + rim || y > 44 - rim) continue;
      const auto value = static_cast<double>(volume.values[(layer * height + j) * width + i]);
      ASSERT_NEAR(value, f(x, y), 1e-4) << name << ' ' << x << ' ' << y;
      ++compared;
    }
  }
  EXPECT_GT(compared, 100U);
}

}  // namespace windsplat::data::test::mesh
