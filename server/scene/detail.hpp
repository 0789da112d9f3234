// Level of detail for a camera, and the lattice and lines of that level. Camera + lattice ->
// halvings -> lattice, reductions, opacities.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "server/data/model/coarsen.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Pixels per world unit at the point of the lattice box nearest to the eye, clamped to the near
// plane.
double pixels_per_unit(const Camera& camera, const Lattice& lattice);

// How much may be merged. With one halving per axis, mean opacity and colour stay within 2 % over
// the trial fields (tests/numerics/level_test.cpp). A line of opacity a represents at most 1 / a:
// more would have to be wider than they are apart, and lines of different directions do not hide
// each other.
struct MergeLimits {
  double samples = 8;  // that one may represent
  int halvings = 1;    // of an axis
};

// How often each axis of a rectilinear lattice is halved: the one with the finest cells first,
// while its widest cell covers less than half a pixel at the nearest point of the box, so that two
// fit in a pixel. Independent of the direction of the camera, so that rotating it does not change
// the level. Curved lattices and the axis of a slice are not halved; no axis is reduced below two
// samples.
inline constexpr double halved_below_px = 0.5;
std::array<int, 3> choose_level(const Camera& camera, const Lattice& lattice,
                                const std::optional<Slice>& slice, const MergeLimits& limits = {});

// Pixels covered by the widest cell of the axis that is halved first; 0 if none is ever halved.
double finest_cell_px(const Camera& camera, const Lattice& lattice,
                      const std::optional<Slice>& slice);

// A level `times` coarser than `level`: each time halves the axis with the finest cells and those
// with cells less than 1.5 times as wide.
std::array<int, 3> coarser_level(const Lattice& lattice, const std::optional<Slice>& slice,
                                 std::array<int, 3> level, int times);

// How volumes of the lattice are reduced to that level.
data::Coarsening coarsening_of(const Lattice& lattice, const std::array<int, 3>& level);

// Merges each group of cells into one of their total width, with the sample at the mean of their
// positions weighted by width. The box is unchanged.
Lattice coarsen_lattice(const Lattice& lattice, const std::array<int, 3>& level);

// Means of a quantity along an axis, weighted by the widths of the cells.
std::vector<double> coarsen_along(const std::vector<double>& values,
                                  const std::vector<double>& widths, int halvings);

// Adjusts the lines of a layer for this level: each represents n lines of full detail, with a
// stride fewer than samples, by the opacity a' = min(1, n a). The excess over 1 increases its
// width, limited by the distance of the merged samples on the screen, because lines within one
// pixel would hide each other.
void merge_lines(const Lattice& fine, const std::array<int, 3>& level, double pixels_per_unit,
                 VectorLayer& layer);

}  // namespace windsplat::scene
