// Positions of the samples of a grid in the world (docs/design/rendering-model.md, "World space").
#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The values of geometry.heightField.
struct Heights {
  std::string name;
  std::string units;
  std::shared_ptr<const data::Volume> values;
};

// `heights` replace the vertical coordinate. Errors: bad_data (coordinates that do not ascend),
// invalid with a pointer into /geometry (a mapping, placement or height field that this grid does
// not allow).
Result<Lattice> place_lattice(const data::Grid& grid, const protocol::GeometryView& geometry,
                              const Heights* heights = nullptr);

// How many times as high as to the scale of y (without y, of x) the vertical axis of a flat lattice
// is drawn; a degree of latitude has 111 km. Pressures, drawn by their logarithm, have the heights
// of the ICAO standard atmosphere at both ends; grids with a longitude and latitude for every
// column the length of their middle column. nullopt: a length is not known, as of levels.
std::optional<double> vertical_exaggeration(const data::Grid& grid, const Lattice& lattice);

// Metres for each world unit along y of a flat lattice, along x where y has no length; a degree of
// latitude has 111 km, and grids with a longitude and latitude for every column have the length of
// their middle column. nullopt: unknown.
std::optional<double> metres_per_unit(const data::Grid& grid, const Lattice& lattice);

// Mean width of the lattice's cells along an axis, world units.
double cell_size(const Lattice& lattice, std::size_t axis);

// The points where a plane meets the edges of the box; their hull is its part in the box.
std::vector<glm::dvec3> points_in_box(const Lattice& lattice, const glm::dvec3& point,
                                      const glm::dvec3& normal);

}  // namespace windsplat::scene
