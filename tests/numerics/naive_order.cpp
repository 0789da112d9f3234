// Kernel positions in visibility order.
#include "tests/numerics/naive_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <tuple>
#include <utility>

namespace windsplat::naive {

namespace {

using engine::reference::AxisPosition;
using engine::reference::LayerGroup;
using scene::Scene;

// Rank of a kernel position along its axis: bricks of eight outward from the brick of the eye,
// upper side first; within a brick outward from the position nearest to the eye, upper side first.
std::tuple<bool, int, bool, int> place_in_bricks(int position, int eye, int count) {
  const int brick = position / 8;
  const int eye_brick = eye / 8;
  const int start = std::clamp(eye, 8 * brick, std::min(8 * brick + 7, count - 1));
  return {brick < eye_brick, std::abs(brick - eye_brick), position < start,
          std::abs(position - start)};
}

OrderedAxis order_axis(const Scene& scene, int a, const std::vector<AxisPosition>& positions) {
  OrderedAxis axis;
  axis.positions = positions;
  const int count = static_cast<int>(positions.size());
  if (scene.camera.perspective) {
    // The kernel position whose cell, bounded midway to its neighbours, contains the eye.
    for (int i = 1; i < count; ++i) {
      const double border = (scene.lattice.positions[a][positions[i - 1].sample] +
                             scene.lattice.positions[a][positions[i].sample]) /
                            2;
      if (scene.camera.eye[a] >= border) axis.eye = i;
    }
  } else {
    axis.eye = scene.camera.forward[a] >= 0 ? 0 : count - 1;
  }
  for (int i = 0; i < count; ++i) axis.order.push_back(i);
  std::sort(axis.order.begin(), axis.order.end(), [&](int p, int q) {
    return place_in_bricks(p, axis.eye, count) < place_in_bricks(q, axis.eye, count);
  });
  return axis;
}

// The sample of the full lattice whose cell contains the eye.
int eye_sample(const Scene& scene, int a) {
  const auto& at = scene.lattice.positions[a];
  const int last = static_cast<int>(at.size()) - 1;
  if (!scene.camera.perspective) return scene.camera.forward[a] >= 0 ? 0 : last;
  int eye = 0;
  for (int i = 1; i <= last; ++i) {
    if (scene.camera.eye[a] >= (at[i - 1] + at[i]) / 2) eye = i;
  }
  return eye;
}

bool eye_inside(const Scene& scene) {
  if (!scene.camera.perspective) return false;
  for (int a = 0; a < 3; ++a) {
    const double eye = scene.camera.eye[a];
    if (eye < scene.lattice.box_min[a] || eye > scene.lattice.box_max[a]) return false;
  }
  return true;
}

}  // namespace

bool Slab::operator<(const Slab& other) const {
  return std::tie(first, second, group) < std::tie(other.first, other.second, other.group);
}

std::vector<Group> order_groups(const Scene& scene) {
  std::vector<Group> groups;
  for (LayerGroup& layers : engine::reference::group_layers(scene)) {
    Group group;
    for (int a = 0; a < 3; ++a) group.axis[a] = order_axis(scene, a, layers.axis[a]);
    group.layers = std::move(layers);
    groups.push_back(std::move(group));
  }
  return groups;
}

int major_axis(const Scene& scene) {
  int best = 0;
  double most = -1;
  for (int a = 0; a < 3; ++a) {
    double width = 0;
    for (const double s : scene.lattice.spacing[a]) width += s / scene.lattice.dims[a];
    const double crossed = std::abs(scene.camera.forward[a]) / width;
    if (crossed > most * (1 + 1e-12)) {
      most = crossed;
      best = a;
    }
  }
  return best;
}

std::vector<Slab> order_slabs(const Scene& scene, const std::vector<Group>& groups, int major) {
  const int eye = eye_sample(scene, major);
  const bool inside = eye_inside(scene);
  std::vector<Slab> slabs;
  for (int g = 0; g < static_cast<int>(groups.size()); ++g) {
    const OrderedAxis& axis = groups[g].axis[major];
    for (int i = 0; i < static_cast<int>(axis.positions.size()); ++i) {
      const int ahead = axis.positions[i].sample - eye;
      const int distance = std::abs(ahead);
      const bool in_front = scene.camera.forward[major] >= 0 ? ahead >= 0 : ahead <= 0;
      if (inside) {
        slabs.push_back({distance, in_front ? 1 : 0, g, i});
      } else {
        slabs.push_back({ahead < 0 ? 1 : 0, distance, g, i});
      }
    }
  }
  std::sort(slabs.begin(), slabs.end());
  return slabs;
}

}  // namespace windsplat::naive
