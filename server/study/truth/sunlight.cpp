#include "server/study/truth/sunlight.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "server/study/truth/integrator.hpp"

namespace windsplat::truth {

namespace {

// The optical depth of a splat on the way from a point on.
Real depth_of(const Splat& splat, const Vec& from, const Vec& way) {
  const Vec o = to_cells(splat.normal, splat.centre - from);
  const Vec d = to_cells(splat.normal, way);
  const Real cells = length(d);
  const Real middle = dot(o, d) / dot(d, d);
  const Real least = length(cross(o, d)) / cells;
  if (least >= outer) return 0;
  const Real half = std::sqrt(outer * outer - least * least) / cells;
  if (middle + half <= 0) return 0;
  std::vector<Real> breaks{std::max(middle - half, Real(0)), middle + half};
  if (least < inner) {
    const Real core = std::sqrt(inner * inner - least * least) / cells;
    for (const Real end : {middle - core, middle + core}) {
      if (end > breaks.front()) breaks.push_back(end);
    }
    std::sort(breaks.begin(), breaks.end());
  }
  // Midpoints that narrow towards the ends, where the derivatives of the kernel are infinite.
  constexpr int steps = 24;
  Real sum = 0;
  for (std::size_t b = 0; b + 1 < breaks.size(); ++b) {
    const Real width = breaks[b + 1] - breaks[b];
    for (int n = 0; n < steps; ++n) {
      const Real w = (n + 0.5L) / steps;
      const Real at = breaks[b] + width * w * w * (3 - 2 * w) - middle;
      const Real r = std::sqrt(least * least + cells * cells * at * at);
      sum += width * 6 * w * (1 - w) / steps * kernel(static_cast<double>(r));
    }
  }
  return splat.rho * sum;
}

Real lit(const scene::Light& light, Real sun) {
  return light.ambient + (1 - static_cast<Real>(light.ambient)) * std::min(sun, Real(1));
}

}  // namespace

Sunlight::Sunlight(const scene::Scene& scene, std::vector<Splat> splats)
    : scene_(scene), splats_(std::move(splats)), sun_(vec(scene.light->sun)) {
  if (scene.lattice.places) throw std::invalid_argument("light on a curved lattice");
}

Vec Sunlight::place(const std::array<int, 3>& sample) const {
  const auto& positions = scene_.lattice.positions;
  return {positions[0][sample[0]], positions[1][sample[1]], positions[2][sample[2]]};
}

Real Sunlight::depth(const Vec& from) const {
  Real sum = 0;
  for (const Splat& splat : splats_) sum += depth_of(splat, from, sun_);
  return scene_.light->shadows * sum;
}

Real Sunlight::transmittance(const std::array<int, 3>& sample) const {
  const scene::Lattice& lattice = scene_.lattice;
  int across = 0;
  std::array<Real, 3> passed{};
  for (int a = 0; a < 3; ++a) {
    Real extent = 0;
    for (const double width : lattice.spacing[a]) extent += width;
    passed[a] = std::abs(sun_[a]) * lattice.dims[a] / extent;
    if (passed[a] > passed[across]) across = a;
  }
  const auto& spacing = lattice.spacing[across];
  Real low = lattice.box_min[across];
  for (int k = 0; k < sample[across]; ++k) low += spacing[k];
  const Vec at = place(sample);
  Real sum = 0;
  for (const Real face : {low, low + spacing[sample[across]]}) {
    sum += std::exp(-depth(at + ((face - at[across]) / sun_[across]) * sun_));
  }
  return sum / 2;
}

Real Sunlight::of_medium(const scene::ScalarLayer& layer, const std::array<int, 3>& sample) const {
  const scene::Light& light = *scene_.light;
  if (layer.shading == scene::Shading::none) return 1;
  if (layer.shading == scene::Shading::gradient) {
    throw std::invalid_argument("shading by gradients has no truth");
  }
  Vec ray = vec(scene_.camera.forward);
  if (scene_.camera.perspective) {
    ray = place(sample) - vec(scene_.camera.eye);
    ray = (1 / length(ray)) * ray;
  }
  const Real g = light.anisotropy;
  const Real phase = (1 - g * g) / std::pow(1 + g * g - 2 * g * dot(ray, sun_), 1.5L);
  return lit(light, light.strength * phase * transmittance(sample));
}

Real Sunlight::of_line(const std::array<int, 3>& sample) const {
  return lit(*scene_.light, scene_.light->strength * transmittance(sample));
}

Real Sunlight::of_ground(const Vec& at) const {
  return lit(*scene_.light, scene_.light->strength * std::exp(-depth(at)));
}

}  // namespace windsplat::truth
