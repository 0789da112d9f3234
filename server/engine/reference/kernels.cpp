// Kernel positions -> splats; the lists of ribbons and splats of a scene.
#include "server/engine/reference/kernels.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "server/light/shade.hpp"

namespace windsplat::engine::reference {

namespace {

using scene::ColorTable;
using scene::ScalarLayer;
using scene::Scene;

// The same bound as in the engine: opaque over any distance, with finite sums.
constexpr double extinction_max = 1e30;

}  // namespace

double table_extinction(const ScalarLayer& layer, double value) {
  const auto& points = layer.extinction;
  const auto at = [&](std::size_t p) { return std::min(points[p][1], extinction_max); };
  if (value < points.front()[0]) return at(0);
  double rho = at(points.size() - 1);
  for (std::size_t p = 0; p + 1 < points.size(); ++p) {
    const double x0 = points[p][0];
    const double x1 = points[p + 1][0];
    if (value >= x0 && value < x1) {
      rho = at(p) + (at(p + 1) - at(p)) * (value - x0) / (x1 - x0);
    }
  }
  return rho;
}

namespace {

// p^T t^2 A A^T q.
double spread(const KernelPosition& position, const Vec& p, const Vec& q) {
  double sum = 0;
  for (const Vec& edge : position.edge) sum += dot(p, edge) * dot(q, edge);
  return footprint_t * footprint_t * sum;
}

}  // namespace

Vec table_color(const ColorTable& table, double value) {
  const auto last = static_cast<double>(table.entries.size() - 1);
  const double width = table.range[1] - table.range[0];
  double place = 0;
  if (width > 0) {
    place = (value - table.range[0]) / width * last;
  } else if (value > table.range[0]) {
    place = last;
  }
  place = std::clamp(place, 0.0, last);
  const auto i = static_cast<std::size_t>(place);
  const auto& a = table.entries[i];
  const auto& b = table.entries[std::min(i + 1, table.entries.size() - 1)];
  const double f = place - static_cast<double>(i);
  Vec color{};
  for (int c = 0; c < 3; ++c) {
    const auto from = static_cast<double>(a[c]);
    color[c] = from + f * (static_cast<double>(b[c]) - from);
  }
  return color;
}

Density make_density(const Scene& scene, const std::vector<const ScalarLayer*>& layers,
                     const KernelPosition& position) {
  Density density;
  const double sun = scene.light ? light::sun_seen(scene, position.from_eye) : 0;
  for (const ScalarLayer* layer : layers) {
    const auto value = static_cast<double>(layer->field->values[position.index]);
    if (std::isnan(value)) continue;
    const double rho = table_extinction(*layer, value);
    if (rho <= 0) continue;
    density.rho += rho;
    const double bright =
        scene.light ? light::medium_light(*scene.light, *layer, position.index, sun) : 1;
    density.color = plus(density.color, rho * bright, table_color(layer->color, value));
  }
  if (density.rho > 0) density.color = scaled(density.color, 1 / density.rho);
  return density;
}

bool lies_beyond_near(const View& view, const KernelPosition& position) {
  if (!view.perspective) return true;
  return position.centre[2] + std::sqrt(spread(position, view.forward, view.forward)) > view.near;
}

// M = v v^T - t^2 A A^T: the tangents of the silhouette are at (M13 +- sqrt(M13^2 - M11 M33)) /
// M33, which cancels where M33 nearly vanishes.
ScreenBox splat_box(const View& view, const KernelPosition& position) {
  constexpr double least = 1e-9;  // of M33, relative to the squared view depth
  const auto s = [&](const Vec& p, const Vec& q) { return spread(position, p, q); };
  const double w = view.half_width;
  const double h = view.half_height;
  const Vec& centre = position.centre;
  if (!view.perspective) {
    const double x = w + centre[0] / view.pixel;
    const double y = h + centre[1] / view.pixel;
    const double dx = std::sqrt(s(view.right, view.right)) / view.pixel;
    const double dy = std::sqrt(s(view.down, view.down)) / view.pixel;
    return {x - dx, x + dx, y - dy, y + dy};
  }
  const double m33 = centre[2] * centre[2] - s(view.forward, view.forward);
  if (m33 <= least * centre[2] * centre[2]) return {0, 2 * w, 0, 2 * h};
  const auto range = [&](int c, const Vec& axis, double middle, double& low, double& high) {
    const double m11 = centre[c] * centre[c] - s(axis, axis);
    const double m13 = centre[c] * centre[2] - s(axis, view.forward);
    const double root = std::sqrt(std::max(m13 * m13 - m11 * m33, 0.0));
    low = middle + (m13 - root) / m33 / view.pixel;
    high = middle + (m13 + root) / m33 / view.pixel;
  };
  ScreenBox box;
  range(0, view.right, w, box.x0, box.x1);
  range(1, view.down, h, box.y0, box.y1);
  return box;
}

KernelBounds kernel_bounds(const Scene& scene) {
  KernelBounds bounds;
  for (const LayerGroup& group : group_layers(scene)) {
    std::uint64_t positions = 1;
    for (const auto& axis : group.axis) positions *= axis.size();
    if (group.lines != nullptr) {
      const auto& segments = group.lines->streamlets;
      bounds.ribbons += segments ? segments->vertices() : positions;
    }
    if (!group.media.empty()) bounds.splats += positions;
  }
  return bounds;
}

Kernels list_kernels(const Scene& scene, const View& view, const CancelToken& cancel) {
  Kernels kernels;
  list_kernels(scene, view, cancel, kernels);
  return kernels;
}

void list_kernels(const Scene& scene, const View& view, const CancelToken& cancel,
                  Kernels& kernels) {
  for (const LayerGroup& group : group_layers(scene)) {
    const bool curved = group.lines != nullptr && group.lines->streamlets;
    if (curved) list_chains(scene, view, *group.lines, kernels);
    for (const AxisPosition& z : group.axis[2]) {
      for (const AxisPosition& y : group.axis[1]) {
        if (cancel.cancelled()) return;
        for (const AxisPosition& x : group.axis[0]) {
          const KernelPosition position = make_kernel_position(scene, view, {x, y, z});
          if (!position.has_cell) continue;
          if (group.lines != nullptr && !curved) {
            const auto ribbon = make_ribbon(scene, view, *group.lines, position);
            if (ribbon) kernels.ribbons.push_back(*ribbon);
          }
          if (group.media.empty() || !lies_beyond_near(view, position)) continue;
          const Density density = make_density(scene, group.media, position);
          if (density.rho <= 0) continue;
          kernels.splats.push_back(
              {position.from_eye, position.inverse, density.rho, density.color});
          kernels.splat_boxes.push_back(splat_box(view, position));
        }
      }
    }
  }
}

}  // namespace windsplat::engine::reference
