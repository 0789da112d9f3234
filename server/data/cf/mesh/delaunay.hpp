// Positions without outlines -> a mesh whose nodes they are, by neighbourhood.
#pragma once

#include <cstddef>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/mesh/mesh.hpp"

namespace windsplat::data::cf {

// Fewer positions are not drawn.
inline constexpr std::size_t centers_min = 100;
// A polygon with a longer edge, in median edges at its corners (their median), is a gap.
inline constexpr double gap_edges = 4;
// Memory for a position while they are triangulated.
inline constexpr std::size_t triangulation_bytes = 512;

struct Triangulation {
  Mesh mesh;             // node i is position i; others than corners have no value
  std::size_t near = 0;  // positions close to another one, which made slivers of the polygons
  double near_degrees = 0;
  // Positions of another one, to 1e-8 radians or a part in 2^31 of a chart.
  std::size_t repeated = 0;
  std::size_t missing = 0;  // positions without longitude or latitude
  std::size_t gaps = 0;     // polygons left out
};

// The Delaunay polygons of positions on the sphere, in degrees: those of a stereographic chart,
// since it maps circles to circles. If the positions surround the globe it is projected from a gap
// between them, and a second one from the opposite has the polygons around that gap. Four or more
// corners lie on a circle. If a quarter of the polygons are slivers, positions closer to each other
// than a thousandth of the mean spacing are one, that of the first; so are then pairs that are
// closer to each other than a twentieth of the way to any other. The others are twins of the mesh.
// Errors: bad_data for a value that is no longitude or latitude, and if fewer than centers_min
// positions differ, if positions more than 1e-6 radians apart fall together in a chart, if they lie
// along lines (half of the polygons have less area than 0.02 squares of their longest edge) or if
// none are left.
Result<Triangulation> triangulate(std::vector<double> longitudes, std::vector<double> latitudes);

}  // namespace windsplat::data::cf
