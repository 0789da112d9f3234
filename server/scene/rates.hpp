// The derivative of world positions by components of a vector, for lines tangent to trajectories in
// the world (space = world).
#pragma once

#include <optional>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/scene/place.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Whether the third component is a rate of pressure (omega) on an axis of pressure or height, such
// that negative values point upward in the world. False on numbered levels, whose direction is
// unknown.
bool rises_where_negative(const data::Grid& grid, const data::FieldInfo& field);

struct Rates {
  std::vector<double> x;  // indexed by y, because meridians converge
  double y = 1;
  std::vector<double> z;  // indexed by z
};

// World units per second per unit of each component. Horizontal: a metre per second covers 1 / (R
// cos(latitude)) of longitude, 1 / R of latitude (R = 6371 km), or its length along an axis in
// metres. Vertical, with pressure p(z) = 1000 hPa exp(-z / H) and H = 7.4 km (an isothermal
// atmosphere near 253 K): w in m/s moves dp/dt = -w p / H along a pressure axis; omega in Pa/s is
// dp/dt there and dz/dt = -omega H / p along a height axis; depth decreases with positive w. The
// rate along an axis of one sample is 0. On the sphere, directions are along local east, north and
// up, so that the scale is uniform: the middle radius of the shell over R. On a curvilinear map,
// degrees are scaled as on a flat one at the mean latitude of each row. With a height field the
// vertical axis is that of the heights (see Placed). Errors: invalid at /vector/space if a third
// component has no known rate along its axis.
Result<Rates> world_rates(const data::Grid& grid, const data::FieldInfo& field,
                          const protocol::GeometryView& geometry, const Lattice& lattice);

// Factors of the components of a vector as a view draws them.
struct ComponentFactors {
  glm::dvec3 scale{1, 1, 1};
  std::optional<Rates> rates;  // in world space, applied after the scale
};
// Those of a view whose grid is placed. Errors: those of world_rates().
Result<ComponentFactors> component_factors(const protocol::View& view, const Placed& placed,
                                           const data::FieldInfo& field);

}  // namespace windsplat::scene
