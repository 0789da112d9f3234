// Splats and lines on a ray -> its light.
#include "server/frame/ray_light.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

#include "server/engine/reference/body.hpp"
#include "server/engine/reference/cell_rules.hpp"
#include "server/engine/reference/profile.hpp"

namespace windsplat::frame {
namespace {

namespace reference = engine::reference;

constexpr int pieces_of_slab = 4;

// The mean cell along the view, of the coarsest medium, or the least depth of a slab: of the
// diagonal of the box (engine/plan).
double slab_depth(const scene::Scene& scene) {
  constexpr double slabs_max = 16384;
  int stride = scene.scalars.empty() && scene.vector ? scene.vector->stride : 1;
  for (const scene::ScalarLayer& layer : scene.scalars) stride = std::max(stride, layer.stride);
  double cells2 = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto& spacing = scene.lattice.spacing[a];
    const auto count = static_cast<double>(spacing.size());
    const double whole = std::accumulate(spacing.begin(), spacing.end(), 0.0);
    const bool sliced = scene.slice && static_cast<std::size_t>(scene.slice->axis) == a;
    const double together = sliced ? 1 : std::min(1.0 * stride, count);
    cells2 +=
        std::pow(scene.camera.forward[static_cast<glm::length_t>(a)] * count / together / whole, 2);
  }
  const double least = glm::length(scene.lattice.box_max - scene.lattice.box_min) / slabs_max;
  return std::max(1 / std::sqrt(cells2), least);
}

const reference::Profile& profile() {
  static const reference::Profile one;
  return one;
}

reference::RibbonHit<double> hit(const RayKernel& kernel, const PictureRay& ray) {
  if (!kernel.line) return {};
  const reference::ScreenBox& box = kernel.box;
  if (ray.x < box.x0 || ray.x > box.x1 || ray.y < box.y0 || ray.y > box.y1) return {};
  return reference::hit_ribbon(*kernel.line, ray.x, ray.y);
}

}  // namespace

double square_difference(const Light& a, const Light& b) {
  double sum = std::pow(a.alpha - b.alpha, 2);
  for (std::size_t c = 0; c < 3; ++c) sum += std::pow(a.rgb[c] - b.rgb[c], 2);
  return sum / 4;
}

RayLight::RayLight(const scene::Scene& scene)
    : scene_(scene), view_(reference::make_view(scene.camera)), slab_(slab_depth(scene)) {
  near_ = view_.perspective ? view_.near : std::numeric_limits<double>::lowest();
  anchor_ = -reference::dot(view_.forward, view_.eye);
}

// What is behind it is hidden; pixels that it covers in part are taken as a whole.
reference::Surface RayLight::body(const PictureRay& ray) const {
  reference::Surface out;
  if (scene_.body) out = reference::body_surface(*scene_.body, view_, ray.x, ray.y);
  if (out.opacity < 0.5) return {std::numeric_limits<double>::max(), 0, {}};
  out.opacity = 1;
  return out;
}

Light RayLight::by_kernels(const RayKernelList& kernels, const PictureRay& ray) const {
  Light out;
  const reference::Surface ground = body(ray);
  for (const RayKernel* const one : kernels) {
    const RayKernel& kernel = *one;
    SplatOnRay on;
    if (kernel.splat.rho > 0) on = splat_on_ray(kernel.splat, ray);
    if (on.middle > ground.depth) on.tau = 0;
    auto line = hit(kernel, ray);
    if (line.depth > ground.depth) line.opacity = 0;
    if (on.tau <= 0 && line.opacity <= 0) continue;
    reference::Cell cell;
    cell.tau = on.tau;
    cell.x = std::clamp(0.5 + (line.depth - on.middle) * std::sqrt(on.cells2), 0.0, 1.0);
    // Splats that may reach the near plane are divided as they are, others as if homogeneous.
    if (on.tau > 0 && kernel.near) {
      const double unseen = part_before(on, near_);
      cell.tau *= 1 - unseen;
      if (unseen < 1) {
        cell.x = std::clamp((part_before(on, line.depth) - unseen) / (1 - unseen), 0.0, 1.0);
      }
    }
    cell.opacity = line.opacity;
    cell.medium = kernel.splat.color;
    cell.line = line.color;
    reference::composite(reference::cell_light(scene::Compositing::analytic, cell), out);
    if (out.transmittance < 1e-5) break;
  }
  if (ground.opacity > 0) reference::cross_surface(ground, out);
  return out;
}

void RayLight::meet(const RayKernelList& kernels, const PictureRay& ray) {
  stretches_.clear();
  surfaces_.clear();
  const reference::Surface ground = body(ray);
  if (ground.opacity > 0) surfaces_.push_back(ground);
  for (const RayKernel* const one : kernels) {
    const RayKernel& kernel = *one;
    const auto line = hit(kernel, ray);
    if (line.opacity > 0 && line.depth < ground.depth)
      surfaces_.push_back({line.depth, line.opacity, line.color});
    if (kernel.splat.rho <= 0) continue;
    const SplatOnRay on = splat_on_ray(kernel.splat, ray);
    if (on.tau <= 0 || on.middle > ground.depth) continue;
    stretches_.push_back({on, kernel.splat.color, half_extent(on)});
  }
  std::sort(surfaces_.begin(), surfaces_.end(),
            [](const auto& a, const auto& b) { return a.depth < b.depth; });
}

RayLight::ByDepth RayLight::by_depth(const RayKernelList& kernels, const PictureRay& ray) {
  meet(kernels, ray);
  ByDepth out;
  if (stretches_.empty()) {
    for (const auto& surface : surfaces_) reference::cross_surface(surface, out.exact);
    out.slabs = out.halves = out.exact;
    return out;
  }
  double from = 1e300;
  double to = -1e300;
  for (const auto& surface : surfaces_) {
    from = std::min(from, surface.depth);
    to = std::max(to, surface.depth);
  }
  for (const Stretch& one : stretches_) {
    from = std::min(from, one.on.middle - one.half);
    to = std::max(to, one.on.middle + one.half);
  }
  from = std::max(from, near_);
  const double first = std::floor((from - anchor_) / slab_);
  const double slabs = std::floor((to - anchor_) / slab_) + 1 - first;
  constexpr double slabs_most = 4096;
  out.known = slabs < slabs_most;
  if (!(slabs > 0) || !out.known) return out;
  const double start = anchor_ + first * slab_;
  const double step = slab_ / pieces_of_slab;
  pieces_.assign(pieces_of_slab * static_cast<std::size_t>(slabs), {});
  for (const Stretch& one : stretches_) {
    const double begin = std::max(one.on.middle - one.half, near_) - start;
    const double end = one.on.middle + one.half - start;
    if (end <= 0) continue;
    const auto last = std::min(pieces_.size() - 1, static_cast<std::size_t>(end / step));
    for (auto k = static_cast<std::size_t>(std::max(begin, 0.0) / step); k <= last; ++k) {
      // Of a piece that the near plane cuts the part beyond it.
      const double far = start + static_cast<double>(k + 1) * step;
      const double length = std::min(step, far - near_);
      if (length <= 0) continue;
      const double z = far - 0.5 * length - one.on.middle;
      const double tau = one.on.rho * profile()(one.on.least2 + one.on.cells2 * z * z) * length;
      for (std::size_t c = 0; c < 3; ++c) pieces_[k][c] += tau * one.color[c];
      pieces_[k][3] += tau;
    }
  }
  std::size_t next_exact = 0;
  std::size_t next_half = 0;
  std::size_t next_slab = 0;
  const auto place = [&](std::size_t piece) { return start + static_cast<double>(piece) * step; };
  for (std::size_t k = 0; k < pieces_.size(); k += pieces_of_slab) {
    Piece whole{};
    for (std::size_t h = k; h < k + pieces_of_slab; h += 2) {
      Piece half{};
      for (std::size_t p = h; p < h + 2; ++p) {
        for (std::size_t c = 0; c < 4; ++c) half[c] += pieces_[p][c];
        pass(pieces_[p], place(p), step, next_exact, out.exact);
      }
      for (std::size_t c = 0; c < 4; ++c) whole[c] += half[c];
      pass(half, place(h), 2 * step, next_half, out.halves);
    }
    pass(whole, place(k), slab_, next_slab, out.slabs);
  }
  return out;
}

// A homogeneous piece, beyond the near plane, and the lines in it.
void RayLight::pass(const Piece& piece, double begin, double whole, std::size_t& next,
                    Light& to) const {
  const double from = std::max(begin, near_);
  const double length = std::max(begin + whole - from, 0.0);
  const double tau = piece[3];
  double passed = 0;
  const auto absorb = [&](double until) {
    if (tau <= 0) return;
    const double absorbed = -std::expm1(-tau * (until - passed)) * to.transmittance;
    for (std::size_t c = 0; c < 3; ++c) to.rgb[c] += absorbed * piece[c] / tau;
    to.alpha += absorbed;
    to.transmittance -= absorbed;
    passed = until;
  };
  for (; next < surfaces_.size() && surfaces_[next].depth < from + length; ++next) {
    absorb(std::clamp((surfaces_[next].depth - from) / std::max(length, 1e-30), passed, 1.0));
    reference::cross_surface(surfaces_[next], to);
  }
  absorb(1);
}

}  // namespace windsplat::frame
