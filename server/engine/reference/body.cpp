// Rays and bodies in world space.
#include "server/engine/reference/body.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "server/ground/paint.hpp"
#include "server/light/ground_light.hpp"
#include "server/terrain/terrain_pixel.hpp"

namespace windsplat::engine::reference {

namespace {

struct SurfaceRay {
  Vec from{};
  Vec along{};  // forward component 1
};

SurfaceRay ray_of(const View& view, double x, double y) {
  const double right = (x - view.half_width) * view.pixel;
  const double down = (y - view.half_height) * view.pixel;
  SurfaceRay ray{view.eye, view.forward};
  Vec& moved = view.perspective ? ray.along : ray.from;
  for (int a = 0; a < 3; ++a) moved[a] += right * view.right[a] + down * view.down[a];
  return ray;
}

// Change of a function of the pixel from one pixel to the next, by central differences.
template <class Function>
double step_of(const Function& value, double x, double y) {
  constexpr double h = 1e-3;
  const double dx = (value(x + h, y) - value(x - h, y)) / (2 * h);
  const double dy = (value(x, y + h) - value(x, y - h)) / (2 * h);
  return std::max(std::hypot(dx, dy), 1e-300);
}

// The part of a pixel within an edge at this distance in pixels.
double within(double pixels) { return std::clamp(0.5 + pixels, 0.0, 1.0); }

using Hit = terrain::PixelSurface;

Hit hit_sphere(const scene::Body& body, const View& view, double x, double y) {
  // Distance of the ray from the centre, and the view depth there.
  const auto nearest = [](const SurfaceRay& ray) {
    return -dot(ray.from, ray.along) / dot(ray.along, ray.along);
  };
  const auto distance_at = [&](double px, double py) {
    const SurfaceRay ray = ray_of(view, px, py);
    return length(plus(ray.from, nearest(ray), ray.along));
  };
  const SurfaceRay ray = ray_of(view, x, y);
  const double distance = distance_at(x, y);
  const double half = std::sqrt(std::max(body.radius * body.radius - distance * distance, 0.0));
  return {nearest(ray) - half / length(ray.along),
          within((body.radius - distance) / step_of(distance_at, x, y)), half / body.radius};
}

Hit hit_ground(const scene::Body& body, const View& view, double x, double y) {
  const auto depth_of = [&](const SurfaceRay& ray) {
    return (body.height - ray.from[2]) / ray.along[2];
  };
  const SurfaceRay ray = ray_of(view, x, y);
  Hit hit{depth_of(ray), 1, std::abs(ray.along[2]) / length(ray.along)};
  if (ray.along[2] == 0) return {};
  for (int a = 0; a < 2; ++a) {
    const auto place = [&](double px, double py) {
      const SurfaceRay at = ray_of(view, px, py);
      return at.from[a] + depth_of(at) * at.along[a];
    };
    const double here = place(x, y);
    const double step = step_of(place, x, y);
    hit.coverage *= std::max(
        within((here - body.low[a]) / step) + within((body.high[a] - here) / step) - 1, 0.0);
  }
  return hit;
}

terrain::View terrain_view(const View& view) {
  const auto vector = [](const Vec& from) { return glm::dvec3(from[0], from[1], from[2]); };
  return {vector(view.eye), vector(view.right), vector(view.down), vector(view.forward),
          view.pixel,       view.near,          view.perspective};
}

Hit hit_terrain(const terrain::Terrain& terrain, const View& view, double x, double y) {
  Hit hit;
  terrain::look(terrain, terrain_view(view), x - 0.5 - view.half_width, y - 0.5 - view.half_height,
                1, &hit);
  return hit;
}

// Nothing if it lies before the near plane.
Hit hit_plain(const scene::Body& body, const View& view, double x, double y) {
  if (body.shape == scene::BodyShape::terrain) return {};
  Hit hit = body.shape == scene::BodyShape::sphere ? hit_sphere(body, view, x, y)
                                                   : hit_ground(body, view, x, y);
  if (view.perspective && hit.depth < view.near) hit.coverage = 0;
  return hit;
}

}  // namespace

Surface body_surface(const scene::Body& body, const View& view, double x, double y) {
  Hit hit = hit_plain(body, view, x, y);
  if (body.terrain) hit = terrain::combined(hit_terrain(*body.terrain, view, x, y), hit);
  Surface out;
  out.depth = hit.depth;
  if (!(hit.coverage > 0)) return out;
  out.opacity = hit.coverage;
  double shade = (scene::body_ambient + (1 - scene::body_ambient) * hit.cosine) * hit.relief;
  std::array<double, 3> color{};
  std::copy(body.color.begin(), body.color.end(), color.begin());
  if (body.paint) {
    color = body.paint->color(body.paint->seen(terrain_view(view), x - view.half_width,
                                               y - view.half_height, hit.depth, hit.normal));
  }
  if (body.light) {
    const SurfaceRay ray = ray_of(view, x, y);
    const Vec place = plus(ray.from, hit.depth, ray.along);
    shade *= body.light->factor({place[0], place[1], place[2]});
  }
  for (std::size_t c = 0; c < 3; ++c) out.color[c] = std::min(shade * color[c], 1.0);
  return out;
}

}  // namespace windsplat::engine::reference
