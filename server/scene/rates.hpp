// How fast a component of the wind moves a point of the picture: the map of positions,
// differentiated. Needed when lines are to be tangent to trajectories as drawn (space = world).
#pragma once

#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Whether the third component is a change of pressure (omega): where it is negative air rises, and
// up is up in the picture on axes of pressure and of height. On numbered levels nobody knows.
bool rises_where_negative(const data::Grid& grid, const data::FieldInfo& field);

struct Rates {
  std::vector<double> x;  // by y index: meridians converge
  double y = 1;
  std::vector<double> z;  // by z index
};

// World units per second per unit of each component. Horizontal: a metre per second covers
// 1 / (R cos(latitude)) of longitude, 1 / R of latitude (R = 6371 km), or the axis' own length.
// Vertical, with pressure p(z) = 1000 hPa exp(-z / H) and H = 7.4 km (an isothermal atmosphere
// near 253 K): w in m/s moves dp/dt = -w p / H along a pressure axis; omega in Pa/s is dp/dt there
// and dz/dt = -omega H / p along a height axis; depth falls as w rises. An axis of one sample has
// no measure: nothing moves along it.
// On the sphere a line's direction is told along the local east, north and up, so that a metre is
// as long anywhere: the shell's middle radius over R; on a curvilinear map degrees are taken as on
// a flat one, at each row's mean latitude. With heights the vertical axis is theirs (see Placed).
// Errors: invalid at /vector/space when a third component has no known rate along its axis.
Result<Rates> world_rates(const data::Grid& grid, const data::FieldInfo& field,
                          const protocol::GeometryView& geometry, const Lattice& lattice);

}  // namespace windsplat::scene
