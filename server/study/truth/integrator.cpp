// Splats and lines -> the light of each ray.
#include "server/study/truth/integrator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "server/study/truth/integrator_kernels.hpp"
#include "server/study/truth/integrator_marks.hpp"
#include "server/study/truth/sunlight.hpp"

namespace windsplat::truth {

namespace {

using scene::Scene;
using scene::VectorLayer;

struct Surface {
  Real depth = 0;
  Real opacity = 0;
  Vec color;
};

// Where the ray through a pixel meets a line.
std::optional<Surface> meet(const Scene& scene, const Line& line, Real x, Real y) {
  const scene::Camera& camera = scene.camera;
  const VectorLayer& layer = *scene.vector;
  const Real pixel = 2 * static_cast<Real>(camera.half_height) / camera.height;
  const auto on_screen = [&](const Vec& p) {
    const Real scale = camera.perspective ? 1 / (p.z * pixel) : 1 / pixel;
    return Vec{camera.width / 2.0L + p.x * scale, camera.height / 2.0L + p.y * scale, 0};
  };
  const Vec from = on_screen(line.a);
  const Vec u = on_screen(line.b) - from;
  const Vec p = Vec{x, y, 0} - from;
  const Real eps = 1e-6L * layer.r2;
  const Real q =
      std::clamp(dot(p - 0.5L * u, u) / std::max(dot(u, u), eps * eps), Real(-0.5L), Real(0.5L));
  const Real w = q + 0.5L;
  const Real distance = length(p - w * u);
  Surface surface;
  Real lit = 1;  // part of the opacity that has light
  if (layer.mark.plain()) {
    if (distance >= layer.r2) return {};
    surface.opacity = layer.opacity * (1 - ramp(distance, layer.r1, layer.r2));
  } else {
    const MarkShare share = mark_share(layer, u, p, w);
    if (!(share.with_halo > 0)) return {};
    surface.opacity = layer.opacity * share.with_halo;
    lit = share.lit / share.with_halo;
  }
  const Real f = camera.perspective ? w * line.a.z / (w * line.a.z + (1 - w) * line.b.z) : w;
  surface.depth = line.a.z + f * (line.b.z - line.a.z);
  const Real at = line.q0 + f * (line.q1 - line.q0) + 0.5L;
  if (layer.moving) {
    const Real turn = at - line.phase;
    surface.opacity *= 1 - std::abs(2 * (turn - std::floor(turn)) - 1);
  }
  const Real top = std::max({line.color.x, line.color.y, line.color.z});
  const auto whitened = [&](Real q) {
    const Real grey = layer.head_desaturation * q;
    return (1 - grey) * line.color + grey * Vec{top, top, top};
  };
  const Vec tail = layer.mark.tail_light * whitened(line.q0 + 0.5L);
  const Vec head = whitened(line.q1 + 0.5L);
  surface.color = lit * ((1 - f) * tail + f * head);
  return surface;
}

// `or`: the largest opacity and the largest premultiplied light of each channel, before the medium.
std::vector<Surface> combined(const std::vector<Surface>& surfaces) {
  Surface all;
  all.depth = -1e300L;
  for (const Surface& one : surfaces) {
    all.opacity = std::max(all.opacity, one.opacity);
    all.color.x = std::max(all.color.x, one.opacity * one.color.x);
    all.color.y = std::max(all.color.y, one.opacity * one.color.y);
    all.color.z = std::max(all.color.z, one.opacity * one.color.z);
  }
  if (!(all.opacity > 0)) return {};
  all.color = (1 / all.opacity) * all.color;
  return {all};
}

// The straight line of sight of a pixel; a step of 1 is a view depth of 1.
struct Sight {
  Vec origin, way;
};

Sight sight_of(const scene::Camera& camera, Real x, Real y) {
  const Real pixel = 2 * static_cast<Real>(camera.half_height) / camera.height;
  const Vec aside = (pixel * (x - camera.width / 2.0L)) * vec(camera.right) -
                    (pixel * (y - camera.height / 2.0L)) * vec(camera.up);
  if (camera.perspective) return {vec(camera.eye), vec(camera.forward) + aside};
  return {vec(camera.eye) + aside, vec(camera.forward)};
}

// A crossing of a line of sight with a surface: its view depth and the unit normal.
struct Crossing {
  Real depth = 0;
  Vec normal;
  bool terrain = false;
};

// The brightness of a slope over that of level ground: sqrt(2) (normal, light), between 0.5 and
// 1.35, with the light from the north-west, as high above the horizon as below the zenith.
Real relief(terrain::Base base, const Vec& at, const Vec& normal) {
  Vec up{0, 0, 1};
  Vec east{1, 0, 0};
  if (base == terrain::Base::globe) {
    up = (1 / length(at)) * at;
    const Vec around = cross(Vec{0, 0, 1}, at);
    east = (1 / length(around)) * around;
  }
  const Vec light = 0.5L * (cross(up, east) - east) + std::sqrt(0.5L) * up;
  return std::clamp(std::sqrt(2.0L) * dot(normal, light), 0.5L, 1.35L);
}

// The nearest triangle of a terrain, of all of them (T. Moeller, B. Trumbore: Fast, Minimum Storage
// Ray/Triangle Intersection, 1997).
std::optional<Crossing> meet_terrain(const terrain::Terrain& terrain, const Sight& sight,
                                     Real least) {
  std::optional<Crossing> nearest;
  const auto try_triangle = [&](const std::array<std::array<int, 2>, 3>& corners) {
    std::array<Vec, 3> p;
    for (std::size_t n = 0; n < 3; ++n) p[n] = vec(terrain.vertex(corners[n][0], corners[n][1]));
    const Vec e1 = p[1] - p[0];
    const Vec e2 = p[2] - p[0];
    const Vec turned = cross(sight.way, e2);
    const Real determinant = dot(e1, turned);
    const Vec off = sight.origin - p[0];
    const Real u = dot(off, turned) / determinant;
    const Vec lifted = cross(off, e1);
    const Real v = dot(sight.way, lifted) / determinant;
    if (!(u >= 0 && v >= 0 && u + v <= 1)) return;
    const Real depth = dot(e2, lifted) / determinant;
    if (!(depth > least) || (nearest && depth >= nearest->depth)) return;
    const Vec across = cross(e1, e2);
    const Vec at = sight.origin + depth * sight.way;
    const bool inward = dot(across, sight.way) * dot(across, at) >= 0;
    if (terrain.base() == terrain::Base::globe && inward) return;
    const auto normal = [&](std::size_t n) {
      return vec(terrain.normal(corners[n][0], corners[n][1]));
    };
    const Vec sum = (1 - u - v) * normal(0) + u * normal(1) + v * normal(2);
    nearest = Crossing{depth, (1 / length(sum)) * sum, true};
  };
  for (int y = 0; y + 1 < terrain.height(); ++y) {
    for (int x = 0; x + 1 < terrain.width(); ++x) {
      try_triangle({{{x, y}, {x + 1, y}, {x + 1, y + 1}}});
      try_triangle({{{x, y}, {x + 1, y + 1}, {x, y + 1}}});
    }
  }
  return nearest;
}

// Where a line of sight enters a sphere about the origin, or passes through a rectangle or a
// terrain.
std::optional<Crossing> meet_plain(const scene::Body& body, const Sight& sight) {
  const auto& [origin, way] = sight;
  Vec normal{0, 0, 1};
  Real depth = 0;
  if (body.shape == scene::BodyShape::sphere) {
    const Real radius = body.radius;
    const Real middle = -dot(origin, way) / dot(way, way);
    const Real beside = length(origin + middle * way);
    if (beside >= radius) return {};
    depth = middle - std::sqrt((radius * radius - beside * beside) / dot(way, way));
    normal = (1 / radius) * (origin + depth * way);
  } else if (body.shape == scene::BodyShape::terrain) {
    return {};
  } else {
    depth = (body.height - origin.z) / way.z;
    const Vec at = origin + depth * way;
    const bool within = at.x > body.low.x && at.x < body.high.x && at.y > body.low.y &&
                        at.y < body.high.y && std::isfinite(depth);
    if (!within) return {};
  }
  return Crossing{depth, normal};
}

std::optional<Surface> meet(const scene::Body& body, const scene::Camera& camera,
                            const Sunlight* light, Real x, Real y) {
  const Sight sight = sight_of(camera, x, y);
  const Real least = camera.perspective ? static_cast<Real>(camera.near) : -1e300L;
  std::optional<Crossing> at = meet_plain(body, sight);
  if (at && !(at->depth > least)) at.reset();
  if (body.terrain) {
    const auto above = meet_terrain(*body.terrain, sight, least);
    if (above && (!at || above->depth < at->depth)) at = above;
  }
  if (!at) return {};
  Real bright = 0.6L + 0.4L * std::abs(dot(at->normal, sight.way)) / length(sight.way);
  if (at->terrain) {
    bright *= relief(body.terrain->base(), sight.origin + at->depth * sight.way, at->normal);
  }
  if (light != nullptr) bright *= light->of_ground(sight.origin + at->depth * sight.way);
  const Vec color = bright * Vec{body.color[0], body.color[1], body.color[2]};
  return Surface{
      at->depth,
      1,
      {std::min(color.x, Real(1)), std::min(color.y, Real(1)), std::min(color.z, Real(1))}};
}

// A splat on a ray: the distance from its centre at view depth z is
// sqrt(least^2 + (cells (z - middle))^2) cells.
struct Stretch {
  Real middle = 0, cells = 0, least = 0;
  double density = 0;  // extinction over C per unit of view depth
  std::array<double, 3> color{};
  Real entry = 0, exit = 0;
};

class Ray {
 public:
  Ray(const Scene& scene, const std::vector<Splat>& splats, Real x, Real y) {
    const scene::Camera& camera = scene.camera;
    const auto [origin, way] = sight_of(camera, x, y);
    start_ = camera.perspective ? Real(camera.near) : -std::numeric_limits<Real>::infinity();
    for (const Splat& splat : splats) add(splat, splat.centre - origin, way);
  }

  Light follow(std::vector<Surface> surfaces, int steps) {
    std::stable_sort(surfaces.begin(), surfaces.end(),
                     [](const Surface& a, const Surface& b) { return a.depth < b.depth; });
    for (const Surface& surface : surfaces) breaks_.push_back(surface.depth);
    std::sort(breaks_.begin(), breaks_.end());
    std::size_t met = 0;
    for (std::size_t b = 0; b < breaks_.size(); ++b) {
      for (; met < surfaces.size() && surfaces[met].depth <= breaks_[b]; ++met) {
        absorb(
            static_cast<double>(surfaces[met].opacity),
            {static_cast<double>(surfaces[met].color.x), static_cast<double>(surfaces[met].color.y),
             static_cast<double>(surfaces[met].color.z)});
        left_ *= 1 - static_cast<double>(surfaces[met].opacity);
      }
      if (b + 1 < breaks_.size()) cross_piece(breaks_[b], breaks_[b + 1], steps);
    }
    return light_;
  }

 private:
  void add(const Splat& splat, const Vec& to_centre, const Vec& way) {
    const Vec o = to_cells(splat.normal, to_centre);
    const Vec d = to_cells(splat.normal, way);
    Stretch s;
    s.cells = length(d);
    s.middle = dot(o, d) / dot(d, d);
    s.least = length(cross(o, d)) / s.cells;
    if (s.least >= outer) return;
    const Real half = std::sqrt(outer * outer - s.least * s.least) / s.cells;
    s.entry = std::max(s.middle - half, start_);
    s.exit = s.middle + half;
    if (s.exit <= start_) return;
    s.density = static_cast<double>(splat.rho * length(way));
    s.color = {static_cast<double>(splat.color.x), static_cast<double>(splat.color.y),
               static_cast<double>(splat.color.z)};
    stretches_.push_back(s);
    breaks_.push_back(s.entry);
    breaks_.push_back(s.exit);
    if (s.least >= inner) return;
    const Real core = std::sqrt(inner * inner - s.least * s.least) / s.cells;
    for (const Real end : {s.middle - core, s.middle + core}) {
      if (end > start_) breaks_.push_back(end);
    }
  }

  // The kernels are smooth between two breaks; at these their derivatives are infinite, so the
  // steps narrow towards both ends.
  void cross_piece(Real from, Real to, int steps) {
    active_.clear();
    for (const Stretch& s : stretches_) {
      if (s.entry < to && s.exit > from) active_.push_back(&s);
    }
    if (active_.empty() || !(to > from)) return;
    for (int n = 0; n < steps; ++n) {
      cross_step(from, to - from, static_cast<Real>(n) / steps, (n + Real(1)) / steps, 0);
    }
  }

  // From the part w0 to w1 of a piece. Opaque steps are halved, as far as their light is seen.
  void cross_step(Real from, Real width, Real w0, Real w1, int halvings) {
    constexpr std::array<double, 3> node{-0.7745966692414834, 0, 0.7745966692414834};
    constexpr std::array<double, 3> weight{5.0 / 18, 8.0 / 18, 5.0 / 18};
    constexpr double thick = 0.25;
    constexpr double unseen = 1e-9;
    constexpr int halvings_max = 120;
    double tau = 0;
    std::array<double, 3> glow{};
    for (std::size_t k = 0; k < node.size(); ++k) {
      const Real w = (w0 + w1 + (w1 - w0) * node[k]) / 2;
      const Real z = from + width * w * w * (3 - 2 * w);
      const auto share = static_cast<double>(width * 6 * w * (1 - w) * weight[k] * (w1 - w0));
      for (const Stretch* s : active_) {
        const Real along = s->cells * (z - s->middle);
        const double r = static_cast<double>(std::sqrt(s->least * s->least + along * along));
        const double part = share * s->density * kernel(r);
        tau += part;
        for (std::size_t c = 0; c < 3; ++c) glow[c] += part * s->color[c];
      }
    }
    if (!(tau > 0)) return;
    if (tau > thick && left_ > unseen && active_.size() > 1 && halvings < halvings_max) {
      const Real middle = (w0 + w1) / 2;
      cross_step(from, width, w0, middle, halvings + 1);
      cross_step(from, width, middle, w1, halvings + 1);
      return;
    }
    absorb(-std::expm1(-tau), {glow[0] / tau, glow[1] / tau, glow[2] / tau});
    left_ *= std::exp(-tau);
    light_.depth += tau;
  }

  void absorb(double alpha, const std::array<double, 3>& color) {
    light_.alpha += left_ * alpha;
    for (std::size_t c = 0; c < 3; ++c) light_.rgb[c] += left_ * alpha * color[c];
  }

  Real start_ = 0;
  std::vector<Stretch> stretches_;
  std::vector<const Stretch*> active_;
  std::vector<Real> breaks_;
  Light light_;
  double left_ = 1;
};

}  // namespace

// The inverse Abel transform of the footprint. With a = sqrt(t^2 - r^2), b = sqrt(s^2 - r^2):
// (1/pi) [2 b / (s t) + 2 / (t (t - s)) (t ln((t + a) / (s + b)) - (a - b))] for r < s, and
// 2 / (pi t (t - s)) (t ln((t + a) / r) - a) up to t.
double kernel(double r) {
  const auto s = static_cast<double>(inner);
  const auto t = static_cast<double>(outer);
  if (r >= t) return 0;
  const double a = std::sqrt(t * t - r * r);
  const double scale = 2 / (std::numbers::pi * t * (t - s));
  if (r >= s) return scale * (t * std::log((t + a) / r) - a);
  const double b = std::sqrt(s * s - r * r);
  return 2 * b / (std::numbers::pi * s * t) + scale * (t * std::log((t + a) / (s + b)) - (a - b));
}

std::vector<Light> integrate(const Scene& scene, std::span<const Pixel> pixels, int steps) {
  const std::vector<Splat> splats = splats_of(scene);
  const std::vector<Line> lines = lines_of(scene);
  std::optional<Sunlight> sunlight;
  if (scene.light && scene.body) sunlight.emplace(scene, splats);
  std::vector<Light> out;
  for (const Pixel& pixel : pixels) {
    const Real x = pixel.x + 0.5L;
    const Real y = pixel.y + 0.5L;
    std::vector<Surface> surfaces;
    for (const Line& line : lines) {
      const auto surface = meet(scene, line, x, y);
      if (surface && surface->opacity > 0) surfaces.push_back(*surface);
    }
    std::optional<Surface> body;
    if (scene.body) body = meet(*scene.body, scene.camera, sunlight ? &*sunlight : nullptr, x, y);
    if (body) {
      std::erase_if(surfaces, [&](const Surface& one) { return one.depth >= body->depth; });
    }
    if (scene.vector && scene.vector->combine_or) surfaces = combined(surfaces);
    if (body) surfaces.push_back(*body);
    out.push_back(Ray(scene, splats, x, y).follow(std::move(surfaces), steps));
    out.back().body = body.has_value();
  }
  return out;
}

std::vector<Light> integrate(const Scene& scene, int steps) {
  std::vector<Pixel> pixels;
  for (int y = 0; y < scene.camera.height; ++y) {
    for (int x = 0; x < scene.camera.width; ++x) pixels.push_back({x, y});
  }
  return integrate(scene, pixels, steps);
}

}  // namespace windsplat::truth
