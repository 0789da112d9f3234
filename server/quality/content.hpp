// What a view shows, as far as it determines the errors of its pictures.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "server/quality/detail_error.hpp"

namespace windsplat::quality {

// Distances across a ray at which the light of the medium is compared, in cells and in heights of
// the picture: those of half a pixel of pictures that are 64 to 1000 pixels high, and more.
inline constexpr std::array<double, 2> cells_apart{1, 2};
inline constexpr std::size_t distances_count = 5;
inline constexpr std::array<double, distances_count> distances{1 / 2000.0, 1 / 800.0, 1 / 320.0,
                                                               1 / 128.0, 1 / 40.0};
using AtDistances = std::array<double, distances_count>;

// Errors of some pixels of a view, composited from the kernels that their rays meet: RMS over the
// picture of linear premultiplied RGBA.
struct Trials {
  double kernel = 0;  // of method `kernel`
  double slab = 0;    // of slabs of one cell, or of the least depth if cells are thinner
  double half = 0;    // of slabs of half a cell, of no meaning if slabs are at least one cell thick
  double thinnest = 0;  // the least depth of a slab, cells
  double stop = 0;      // of ending rays at the transmittance of the view
};

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
  // Its second differences, and those between both sides, to the right and left.
  std::array<double, cells_apart.size()> cell_bends{0.062, 0.14};
  AtDistances bends{6.3e-5, 3.8e-4, 2.2e-3, 0.012, 0.068};
  AtDistances shifts{2.8e-3, 7.1e-3, 0.0175, 0.042, 0.11};
  double order = 3.7e-3;     // its change if neighbouring cells changed places along the ray
  double step_cell = 0.025;  // width of the cells where it differs
  std::optional<Trials> trials = std::nullopt;
  // Mean over the picture of its change by what tolerances leave out, at some of its pixels.
  std::optional<double> skipped_change = std::nullopt;
  // Of a picture from a coarser level than would suffice.
  std::optional<DetailError> detail = std::nullopt;
};

// A quantity at any distance: powers of it between those known, beyond them constant, and below
// them of an order, as where the light is smooth.
double at_distance(const AtDistances& known, double distance, int order);

// The same content `times` as large in the picture.
Content scaled(Content content, double times);

}  // namespace windsplat::quality
