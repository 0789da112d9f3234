// Curved lattices: terrain, curvilinear maps and the globe. Grid and heights -> a position for
// every sample.
#pragma once

#include <array>
#include <optional>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The rectilinear lattice of the axes. vertical_extent: raw coordinates of the bottom and top of
// the box in place of the outermost cell edges.
Result<Lattice> place_straight(const data::Grid& grid, const protocol::GeometryView& geometry,
                               const std::optional<std::array<double, 2>>& vertical_extent);

// For a mapping other than flat, for heights, or for both. The box is that of all cells; off the
// sphere it is centred on the origin and its longest edge is 2. On the sphere the outermost edge
// has the radius 1 and the shell is 0.15 times geometry.scale[2] of its inner radius thick;
// longitude 0 lies towards -y, where azimuth 0 looks from, longitude 90 towards +x.
Result<Lattice> bend_lattice(const data::Grid& grid, const protocol::GeometryView& geometry,
                             const Heights* heights);

// Sets the box of a curved lattice: the bounding box of all cells, each the parallelepiped of its
// edges. The edge along an axis of one sample is extended in every direction.
void set_box(Lattice& lattice);

// Errors: invalid at /geometry/mapping if the grid lacks the necessary longitudes and latitudes.
Result<void> check_mapping(const data::Grid& grid, protocol::GeometryMapping mapping);

// The grid with the mean heights of its levels as vertical axis. Errors: invalid at
// /geometry/heightField (a level without heights, or not above the one below it).
Result<data::Grid> grid_with_heights(const data::Grid& grid, const Heights& heights);

}  // namespace windsplat::scene
