// Kernel positions along the axes of a lattice.
#include "server/engine/positions.hpp"

#include <algorithm>
#include <numeric>
#include <span>

#include "server/base/check.hpp"
#include "server/engine/layers/chains.hpp"

namespace windsplat::engine {

using scene::Camera;
using scene::Scene;

namespace {

void add_kernel(const Scene& scene, int a, const AxisKernel& kernel, AxisArrays& axis) {
  const Camera& camera = scene.camera;
  axis.sample.push_back(kernel.sample);
  axis.group.push_back(kernel.group);
  const double position = scene.lattice.positions[a][kernel.sample];
  const double from_eye = position - camera.eye[a];
  axis.position.push_back(position);
  axis.camera.push_back(from_eye * camera.right[a]);
  axis.camera.push_back(from_eye * -camera.up[a]);
  axis.camera.push_back(from_eye * camera.forward[a]);
  axis.from_eye.push_back(static_cast<float>(from_eye));
  axis.world.push_back(static_cast<float>(position));
  axis.cell.push_back(static_cast<float>(kernel.cell));
  axis.inverse_cell.push_back(1.0F / axis.cell.back());
}

// A slice has one kernel position along its axis, independent of the stride. Of a part, those
// within it, which are kernels of the whole.
void add_kernels(const Scene& scene, int a, int stride, const data::Box& held, AxisArrays& axis) {
  const auto& spacing = scene.lattice.spacing[a];
  if (scene.slice && scene.slice->axis == a) {
    const int sample = scene.slice->sample;
    WINDSPLAT_CHECK(sample >= 0 && sample < scene.lattice.dims[a]);
    add_kernel(scene, a, {sample, 1, spacing[sample]}, axis);
    return;
  }
  const int samples = scene.lattice.drawn(a);
  const auto drawn = std::span(spacing).first(static_cast<std::size_t>(samples));
  WINDSPLAT_CHECK(held.first[a] % (kernels::brick_side * stride) == 0);
  const int end = std::min(samples, held.first[a] + held.count[a]);
  WINDSPLAT_CHECK(end == samples || end % stride == 0);
  for (int first = held.first[a]; first < end; first += stride) {
    add_kernel(scene, a, axis_kernel(drawn, stride, first), axis);
  }
}

}  // namespace

void place_axis(const Scene& scene, int a, int stride, const data::Box& held, AxisArrays& axis) {
  clear(axis);
  add_kernels(scene, a, stride, held, axis);
  const int count = static_cast<int>(axis.sample.size());
  visit_order(count, eye_index(scene.camera, a, axis.position), axis.visit);
  for (int first = 0; first < count;) {
    const int brick = axis.visit[first] / kernels::brick_side;
    int last = first;
    while (last < count && axis.visit[last] / kernels::brick_side == brick) ++last;
    axis.bricks.push_back({first, last - first});
    first = last;
  }
}

float widest_cell(const Scene& scene, int a, int stride, const AxisArrays& axis) {
  float widest = *std::max_element(axis.cell.begin(), axis.cell.end());
  if (!scene.lattice.part) return widest;
  for (int first = 0; first < scene.lattice.dims[a]; first += stride) {
    const AxisKernel kernel = axis_kernel(scene.lattice.spacing[a], stride, first);
    widest = std::max(widest, static_cast<float>(kernel.cell));
  }
  return widest;
}

AxisKernel axis_kernel(std::span<const double> spacing, int stride, int first) {
  const int last = std::min(first + stride, static_cast<int>(spacing.size())) - 1;
  const double cell = std::accumulate(spacing.begin() + first, spacing.begin() + last + 1, 0.0);
  return {first + (last - first) / 2, last - first + 1, cell};
}

int eye_index(const Camera& camera, int axis, const std::vector<double>& positions) {
  const int last = static_cast<int>(positions.size()) - 1;
  if (!camera.perspective) return camera.forward[axis] >= 0 ? 0 : last;
  int index = 0;
  while (index < last && camera.eye[axis] >= 0.5 * (positions[index] + positions[index + 1])) {
    ++index;
  }
  return index;
}

void visit_order(int count, int eye, std::vector<int>& order) {
  order.clear();
  const auto visit_brick = [&](int brick) {
    const int first = brick * kernels::brick_side;
    const int last = std::min(first + kernels::brick_side, count) - 1;
    const int start = std::clamp(eye, first, last);
    for (int i = start; i <= last; ++i) order.push_back(i);
    for (int i = start - 1; i >= first; --i) order.push_back(i);
  };
  const int bricks = (count + kernels::brick_side - 1) / kernels::brick_side;
  const int own = eye / kernels::brick_side;
  for (int brick = own; brick < bricks; ++brick) visit_brick(brick);
  for (int brick = own - 1; brick >= 0; --brick) visit_brick(brick);
}

}  // namespace windsplat::engine
