// Lattice -> how densely lines are drawn by default (docs/design/rendering-model.md, "Defaults").
#pragma once

#include <optional>

#include "protocol/view.hpp"
#include "server/data/model/volume.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Increment for rounding to readable numbers, for values up to `most` > 0.
double readable_grain(double most);

struct LineSpacing {
  int stride = 1;     // grid samples
  double length = 0;  // of the longest line, world units
};

// How lines of the longest length lie in a picture of the default size from the default viewpoint.
struct LineDensity {
  double coverage;  // area of all lines over that of the projected box
  double apart_px;  // distance of kernels along a row, pixels
  double gap;       // distance of neighbouring lines in a layer of parallel ones, in line widths
};
LineDensity line_density(const LineSpacing& spacing, const Lattice& lattice,
                         const std::optional<Slice>& slice);

// The smallest stride with which lines of at least two strides and 24 line widths cover at most 0.8
// of the projected box and keep three line widths apart, and their length, at most five strides.
// Where the mean magnitude is a quarter of the top of the range, lines then have 6 widths on the
// mean. Axes of few samples limit the stride: three layers of those that have five are drawn, and
// both ends of shorter ones.
LineSpacing default_spacing(const Lattice& lattice, const std::optional<Slice>& slice);

// A length in strides, rounded down to three digits; for a slice those of the axes in its plane.
double spaced_length(double strides, int stride, const Lattice& lattice,
                     const std::optional<Slice>& slice);

// The magnitude below which lines are left out. Where the stride suffices, these are the ones that
// are shorter than twice their width and show no direction, but at most the weaker half; otherwise
// all but those that cover 0.8 of the projected box: more would hide the flow behind the nearest
// layer. At least a hundredth of the top of the range; otherwise below the greatest magnitude, so
// that a uniform flow is drawn. For a slice, only its own lines and area count.
double default_min_magnitude(const protocol::Range& magnitude_range, const LineSpacing& spacing,
                             const data::Volume& volume, const Lattice& lattice,
                             const std::optional<Slice>& slice);

}  // namespace windsplat::scene
