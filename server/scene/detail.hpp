// Level of detail: how coarse a lattice may be drawn for a camera, and the lattice and lines of
// that level. Camera + lattice -> halvings -> lattice, averages, opacities.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "server/data/model/coarsen.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Pixels that a world unit across the view covers where the lattice's box is nearest to the eye
// (but not before the near plane).
double pixels_per_unit(const Camera& camera, const Lattice& lattice);

// How often each axis of a rectilinear lattice is halved: as long as its widest cell's edge, seen
// from whatever side, covers less than `below_px` where the box is nearest. Which way the camera
// looks does not matter: turning it never changes the level. Bent lattices and the axis of a slice
// are not halved, an axis never below two samples.
//
// A medium is smooth: below a pixel a sample it is averaged, so that what is drawn has cells of at
// most two pixels. Lines are not: fewer and thicker ones are grainier, so that where there are any
// two cells have to fit in a pixel.
inline constexpr double halved_below_px = 1;
inline constexpr double halved_with_lines_below_px = 0.5;
std::array<int, 3> choose_level(const Camera& camera, const Lattice& lattice,
                                const std::optional<Slice>& slice,
                                double below_px = halved_below_px);

// Pixels that the widest cell covers along the axis that is halved first; 0 where none ever is.
double finest_cell_px(const Camera& camera, const Lattice& lattice,
                      const std::optional<Slice>& slice);

// A level `times` coarser than `level`: each time the axes of the finest cells are halved, and
// those whose cells are less than 1.5 times as wide.
std::array<int, 3> coarser_level(const Lattice& lattice, const std::optional<Slice>& slice,
                                 std::array<int, 3> level, int times);

// How to average the lattice's volumes for that level.
data::Coarsening coarsening_of(const Lattice& lattice, const std::array<int, 3>& level);

// Each group of cells as one: as wide as all of them, its sample at their middle (the mean of the
// samples' places weighted by width). The box stays.
Lattice coarsen_lattice(const Lattice& lattice, const std::array<int, 3>& level);

// Means of a quantity along an axis, weighted by the cells' widths.
std::vector<double> coarsen_along(const std::vector<double>& values,
                                  const std::vector<double>& widths, int halvings);

// The lines of a layer that is drawn at this level: one stands for as many as its samples, with
// their opacity together, a' = min(1, n a). What is beyond 1 goes into its width, but no more than
// the samples' places lie apart on the screen: side by side within a pixel they would hide each
// other.
void merge_lines(const Lattice& fine, const std::array<int, 3>& level, double pixels_per_unit,
                 VectorLayer& layer);

}  // namespace windsplat::scene
