// What a view shows, as far as it determines the errors of its pictures.
#pragma once

#include <array>
#include <cstddef>

namespace windsplat::quality {

// Distances across a ray at which the light of the medium is compared, in cells.
inline constexpr std::size_t bends_count = 4;
inline constexpr std::array<double, bends_count> bend_distances{0.125, 0.35, 1, 2};

// Lengths are in heights of the picture. Means are over what is visible, weighted by its light. The
// defaults are medians over the generated family (docs/benchmarks/error.md).
struct Content {
  double lines = 0.5;        // RMS over the picture of the opacity of its lines
  double layers = 4;         // lines over one another where there are any, times their opacity
  double length = 0.084;     // length of a line as projected
  double shade = 0.07;       // |difference| of the colours of neighbouring lines
  double gaps = 0.01;        // share of the neighbours of a line that have none
  double line_depth = 0.09;  // optical depth of the medium of one cell at a line
  double depth = 2.7;        // optical depth of the medium along a ray
  double cell_depth = 0.4;   // optical depth of the medium of one cell
  double tint = 0.08;        // |difference| of the colours of the medium of neighbours along a ray
  double cell = 0.027;       // cube root of the volume of a cell
  double finest_cell = 0.025;  // the narrowest edge of a cell
  // The light of the medium alone: root of the integral of squares over the picture.
  double step = 0.063;  // its difference from one cell to the next
  // Its second difference at each of the distances.
  std::array<double, bends_count> bends{2e-3, 0.013, 0.062, 0.14};
  double incline = 0.07;     // its difference for each cell, over short distances
  double order = 3.7e-3;     // its change if neighbouring cells changed places along the ray
  double step_cell = 0.025;  // width of the cells where it differs
};

// The same content `times` as large in the picture.
inline Content scaled(Content content, double times) {
  content.length *= times;
  content.cell *= times;
  content.finest_cell *= times;
  content.step_cell *= times;
  return content;
}

}  // namespace windsplat::quality
