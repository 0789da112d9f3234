// Scene -> the order in which the naive renderer draws its kernel positions.
#pragma once

#include <array>
#include <vector>

#include "server/engine/reference/kernels.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::naive {

// The kernel positions along an axis.
struct OrderedAxis {
  std::vector<engine::reference::AxisPosition> positions;
  int eye = 0;
  std::vector<int> order;  // kernel positions in rendering order
};

// Layers of one stride.
struct Group {
  engine::reference::LayerGroup layers;
  std::array<OrderedAxis, 3> axis;
};

std::vector<Group> order_groups(const scene::Scene& scene);

// The axis along which the view crosses most cells per unit length.
int major_axis(const scene::Scene& scene);

// The kernel positions of a group that share one along the major axis. From outside the box `first`
// is the side of the eye, where the sheets above it come first, and `second` the distance; from
// inside, sheets are ordered by distance, of two equally near ones first that behind the eye.
struct Slab {
  int first;
  int second;
  int group;
  int position;
  bool operator<(const Slab& other) const;
};

// The slabs of all groups, front to back.
std::vector<Slab> order_slabs(const scene::Scene& scene, const std::vector<Group>& groups,
                              int major);

}  // namespace windsplat::naive
