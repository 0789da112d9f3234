// Scene -> kernel positions and their cells.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "server/engine/reference/kernels.hpp"

namespace windsplat::engine::reference {

namespace {

using scene::ScalarLayer;
using scene::Scene;

Vec to_vec(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

Vec position_of(const scene::Lattice& lattice, const std::array<int, 3>& sample) {
  const auto& at = (*lattice.places)[lattice.number_of(sample)];
  return {static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
}

// A unit vector perpendicular to v; its sign is arbitrary but deterministic.
Vec any_normal(const Vec& v) {
  int least = 0;
  for (int a = 1; a < 3; ++a) {
    if (std::abs(v[a]) < std::abs(v[least])) least = a;
  }
  Vec axis{};
  axis[least] = 1;
  const Vec n = cross(v, axis);
  return scaled(n, 1 / length(n));
}

// Edges of a curved cell; those along axes of one sample are perpendicular to the others.
std::array<Vec, 3> curved_edges(const scene::Lattice& lattice,
                                const std::array<AxisPosition, 3>& s) {
  const std::array<int, 3> sample{s[0].sample, s[1].sample, s[2].sample};
  std::array<Vec, 3> edge{};
  std::array<bool, 3> known{};
  for (int a = 0; a < 3; ++a) {
    if (lattice.dims[a] == 1) continue;
    std::array<int, 3> before = sample;
    std::array<int, 3> after = sample;
    before[a] = std::max(sample[a] - 1, 0);
    after[a] = std::min(sample[a] + 1, lattice.dims[a] - 1);
    int steps = after[a] - before[a];
    if (a == 0 && lattice.around > 0) {
      before[a] = (sample[a] + lattice.around - 1) % lattice.around;
      after[a] = (sample[a] + 1) % lattice.around;
      steps = 2;
    }
    const Vec across = plus(position_of(lattice, after), -1, position_of(lattice, before));
    edge[a] = scaled(across, static_cast<double>(s[a].samples) / steps);
    known[a] = true;
  }
  for (int a = 0; a < 3; ++a) {
    if (known[a]) continue;
    const int b = (a + 1) % 3;
    const int c = (a + 2) % 3;
    Vec along{};
    if (known[b] && known[c]) {
      along = cross(edge[b], edge[c]);
      along = scaled(along, 1 / length(along));
    } else if (known[b] || known[c]) {
      along = any_normal(known[b] ? edge[b] : edge[c]);
    } else {
      along[a] = 1;
    }
    edge[a] = scaled(along, lattice.spacing[a][0]);
    known[a] = true;
  }
  return edge;
}

// Smallest volume of a cell relative to that of a box with edges of the same lengths.
constexpr double flattest = 1e-6;

double volume_of(const std::array<Vec, 3>& edge) { return dot(edge[0], cross(edge[1], edge[2])); }

bool spans_volume(const std::array<Vec, 3>& edge) {
  const double upright = length(edge[0]) * length(edge[1]) * length(edge[2]);
  return std::abs(volume_of(edge)) > flattest * upright;
}

std::array<Vec, 3> inverse_of(const std::array<Vec, 3>& edge) {
  const double volume = volume_of(edge);
  return {scaled(cross(edge[1], edge[2]), 1 / volume), scaled(cross(edge[2], edge[0]), 1 / volume),
          scaled(cross(edge[0], edge[1]), 1 / volume)};
}

}  // namespace

View make_view(const scene::Camera& camera) {
  View view;
  view.eye = to_vec(camera.eye);
  view.right = to_vec(camera.right);
  view.down = to_vec(-camera.up);
  view.forward = to_vec(camera.forward);
  view.pixel = 2 * camera.half_height / camera.height;
  view.near = camera.near;
  view.half_width = 0.5 * camera.width;
  view.half_height = 0.5 * camera.height;
  view.perspective = camera.perspective;
  return view;
}

std::vector<AxisPosition> axis_positions(const Scene& scene, int axis, int stride,
                                         const data::Box& held) {
  const auto& spacing = scene.lattice.spacing[axis];
  if (scene.slice && scene.slice->axis == axis) {
    const int sample = scene.slice->sample;
    return {{sample, 1, spacing[sample]}};
  }
  const int dim = scene.lattice.drawn(axis);
  const int end = std::min(dim, held.first[axis] + held.count[axis]);
  std::vector<AxisPosition> positions;
  for (int done = held.first[axis]; done < end;) {
    const int samples = std::min(stride, dim - done);
    AxisPosition position{done + (samples - 1) / 2, samples, 0};
    for (int n = 0; n < samples; ++n) position.cell += spacing[done++];
    positions.push_back(position);
  }
  return positions;
}

std::vector<LayerGroup> group_layers(const Scene& scene) {
  std::vector<LayerGroup> groups;
  if (scene.vector) groups.push_back({scene.vector->stride, &*scene.vector, {}, {}});
  for (const ScalarLayer& layer : scene.scalars) {
    auto same = std::find_if(groups.begin(), groups.end(),
                             [&](const LayerGroup& g) { return g.stride == layer.stride; });
    if (same == groups.end()) same = groups.insert(same, {layer.stride, nullptr, {}, {}});
    same->media.push_back(&layer);
  }
  for (LayerGroup& group : groups) {
    const bool lines = group.lines != nullptr;
    const data::Box held = lines ? scene::held_vectors(*group.lines, scene.lattice).box
                                 : scene.lattice.held_part().box;
    for (int a = 0; a < 3; ++a) group.axis[a] = axis_positions(scene, a, group.stride, held);
  }
  return groups;
}

KernelPosition make_kernel_position(const Scene& scene, const View& view,
                                    const std::array<AxisPosition, 3>& positions) {
  KernelPosition position;
  Vec world{};
  for (int a = 0; a < 3; ++a) {
    position.sample[a] = positions[a].sample;
    position.cell[a] = positions[a].cell;
    world[a] = scene.lattice.positions[a][positions[a].sample];
  }
  position.index = scene.lattice.number_of(position.sample);
  if (scene.lattice.places) {
    world = position_of(scene.lattice, position.sample);
    position.edge = curved_edges(scene.lattice, positions);
    position.has_cell = spans_volume(position.edge);
    if (position.has_cell) position.inverse = inverse_of(position.edge);
  } else {
    for (int a = 0; a < 3; ++a) {
      position.edge[a][a] = positions[a].cell;
      position.inverse[a][a] = 1 / positions[a].cell;
    }
  }
  position.from_eye = plus(world, -1, view.eye);
  position.centre = to_camera(view, position.from_eye);
  return position;
}

}  // namespace windsplat::engine::reference
