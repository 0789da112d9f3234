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

constexpr double pieces_of_cell = 4;

// Mean cells passed by a direction, of the coarsest medium.
double cells_along(const scene::Scene& scene, const Vec& direction) {
  int stride = scene.scalars.empty() && scene.vector ? scene.vector->stride : 1;
  for (const scene::ScalarLayer& layer : scene.scalars) stride = std::max(stride, layer.stride);
  double cells2 = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto& spacing = scene.lattice.spacing[a];
    const auto count = static_cast<double>(spacing.size());
    const double whole = std::accumulate(spacing.begin(), spacing.end(), 0.0);
    const bool sliced = scene.slice && static_cast<std::size_t>(scene.slice->axis) == a;
    const double together = sliced ? 1 : std::min(1.0 * stride, count);
    cells2 += std::pow(direction[a] * count / together / whole, 2);
  }
  return std::sqrt(cells2);
}

// Of a slab: of the diagonal of the box (engine/plan).
double least_depth(const scene::Scene& scene) {
  constexpr double slabs_max = 16384;
  return glm::length(scene.lattice.box_max - scene.lattice.box_min) / slabs_max;
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

RayGround::RayGround(const scene::Scene& scene)
    : scene_(scene), view_(reference::make_view(scene.camera)) {}

reference::Surface RayGround::at(const PictureRay& ray) {
  const reference::Surface none{std::numeric_limits<double>::max(), 0, {}};
  if (!scene_.body) return none;
  const auto [found, is_new] = known_.try_emplace({ray.x, ray.y}, none);
  if (is_new) {
    const reference::Surface met = reference::body_surface(*scene_.body, view_, ray.x, ray.y);
    if (met.opacity >= 0.5) found->second = {met.depth, 1, met.color};
  }
  return found->second;
}

RayLight::RayLight(const scene::Scene& scene, RayGround& ground) : scene_(scene), ground_(ground) {
  const reference::View view = reference::make_view(scene.camera);
  const double cell = 1 / cells_along(scene, view.forward);
  const double least = least_depth(scene);
  constexpr double cells_most = 1e9;
  thinnest_ = std::min(least / cell, cells_most);
  slab_ = std::max(cell, least);
  pieces_of_slab_ = pieces_of_cell * std::max(1.0, std::ceil(thinnest_));
  near_ = view.perspective ? view.near : std::numeric_limits<double>::lowest();
  anchor_ = -reference::dot(view.forward, view.eye);
}

Light RayLight::by_kernels(const RayKernelList& kernels, const PictureRay& ray, bool skips) const {
  Light out;
  const reference::Surface ground = ground_.at(ray);
  for (const RayKernel* const one : kernels) {
    const RayKernel& kernel = *one;
    SplatOnRay on;
    if (kernel.splat.rho > 0 && !(skips && kernel.thin)) on = splat_on_ray(kernel.splat, ray);
    if (on.middle > ground.depth) on.tau = 0;
    auto line = skips && kernel.weak ? decltype(hit(kernel, ray)){} : hit(kernel, ray);
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
  const reference::Surface ground = ground_.at(ray);
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

// Cells that a ray passes for each one that the view's axis passes, rounded: rays at a slant pass
// more of them for each unit of depth, so that their pieces are made shallower.
double RayLight::slant_of(const PictureRay& ray) const {
  if (scene_.lattice.places) return std::round(ray.length);
  const double cells = slab_ * cells_along(scene_, ray.direction);
  return std::round(cells / std::max(1.0, thinnest_));
}

RayLight::ByDepth RayLight::by_depth(const RayKernelList& kernels, const PictureRay& ray) {
  meet(kernels, ray);
  ByDepth out;
  double from = 1e300;
  double to = -1e300;
  for (const Stretch& one : stretches_) {
    from = std::min(from, one.on.middle - one.half);
    to = std::max(to, one.on.middle + one.half);
  }
  from = std::max(from, near_);
  if (!(to >= from)) {
    for (const auto& surface : surfaces_) reference::cross_surface(surface, out.exact);
    out.slabs = out.halves = out.exact;
    return out;
  }
  // Of the slabs only pieces where there is a medium: cells may be much thinner than a slab.
  constexpr double pieces_most = 16384;
  const double start = anchor_ + std::floor((from - anchor_) / slab_) * slab_;
  const double slabs = std::floor((to - start) / slab_) + 1;
  const double most = std::floor(pieces_most / (slabs * pieces_of_slab_));
  const double slant = std::clamp(slant_of(ray), 1.0, std::max(1.0, most));
  const double in_slab = slant * pieces_of_slab_;
  const double step = slab_ / in_slab;
  const double first = std::floor((from - start) / step);
  const double count = std::floor((to - start) / step) + 1 - first;
  out.known = count < pieces_most;
  if (!out.known) return out;
  pieces_.assign(static_cast<std::size_t>(count), {});
  const Division division{start, step, static_cast<std::size_t>(first),
                          static_cast<std::size_t>(slant)};
  for (const Stretch& one : stretches_) divide(one, division);
  const auto whole = static_cast<std::size_t>(in_slab);
  pass_in(division, 1, out.exact, &out.end);
  pass_in(division, whole / 2, out.halves);
  pass_in(division, whole, out.slabs);
  return out;
}

// Its light in each piece.
void RayLight::divide(const Stretch& one, const Division& by) {
  const double begin = std::max(one.on.middle - one.half, near_) - by.start;
  const double end = one.on.middle + one.half - by.start;
  if (end <= 0) return;
  const auto last =
      std::min(by.first + pieces_.size() - 1, static_cast<std::size_t>(end / by.step));
  const auto next = static_cast<std::size_t>(std::max(begin, 0.0) / by.step);
  for (std::size_t k = std::max(by.first, next); k <= last; ++k) {
    // Of a piece that the near plane cuts the part beyond it.
    const double far = by.start + static_cast<double>(k + 1) * by.step;
    const double length = std::min(by.step, far - near_);
    if (length <= 0) continue;
    const double z = far - 0.5 * length - one.on.middle;
    const double tau = one.on.rho * profile()(one.on.least2 + one.on.cells2 * z * z) * length;
    Piece& piece = pieces_[k - by.first];
    for (std::size_t c = 0; c < 3; ++c) piece[c] += tau * one.color[c];
    piece[3] += tau;
  }
}

// Every `together` pieces as one.
void RayLight::pass_in(const Division& by, std::size_t together, Light& to, End* end) const {
  std::size_t next = 0;
  const double stop = scene_.stop_transmittance;
  const std::size_t behind = by.first + pieces_.size();
  for (std::size_t k = by.first / together * together; k < behind; k += together) {
    Piece sum{};
    for (std::size_t p = std::max(k, by.first); p < std::min(k + together, behind); ++p) {
      for (std::size_t c = 0; c < 4; ++c) sum[c] += pieces_[p - by.first][c];
    }
    const double begin = by.start + static_cast<double>(k) * by.step;
    pass(sum, begin, static_cast<double>(together) * by.step, next, to);
    if (end == nullptr || to.transmittance > stop || (k + 1) % by.slant != 0) continue;
    if (end->left.empty()) {
      const double piece = by.step * static_cast<double>(by.slant);
      end->piece = std::llround((by.start - anchor_) / piece) + static_cast<int>(k / by.slant);
    }
    if (end->left.empty() || end->left.back() > 0.01 * stop) end->left.push_back(to.transmittance);
  }
  for (; next < surfaces_.size(); ++next) reference::cross_surface(surfaces_[next], to);
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
