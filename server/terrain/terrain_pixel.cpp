// Rays through the corners and the middles of pixels, and more at silhouettes.
#include "server/terrain/terrain_pixel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>

#include "server/base/check.hpp"

namespace windsplat::terrain {

namespace {

constexpr int parts = 4;  // rays along a side of a pixel at a silhouette
static_assert((side_max + 1) * (side_max + 1) + side_max * side_max <= rays_max);
static_assert(parts * parts <= rays_max);

Ray ray_at(const View& view, double right, double down) {
  const glm::dvec3 aside = view.pixel * (right * view.right + down * view.down);
  if (view.perspective) return {view.eye, view.forward + aside, view.near};
  return {view.eye + aside, view.forward, std::numeric_limits<double>::lowest()};
}

bool is_met(const Hit& hit) { return hit.along < std::numeric_limits<double>::infinity(); }

double cosine_of(const Ray& ray, const Hit& hit) {
  return std::min(std::abs(glm::dot(ray.along, hit.normal)) / glm::length(ray.along), 1.0);
}

PixelSurface surface_at(const Terrain& terrain, const Ray& ray, const Hit& hit) {
  const bool globe = terrain.base() == Base::globe;
  const glm::dvec3 up =
      globe ? glm::normalize(ray.from + hit.along * ray.along) : glm::dvec3(0, 0, 1);
  return {hit.along, 1, cosine_of(ray, hit), relief_of(hit.normal, up, terrain.base()), hit.normal};
}

// A pixel that the terrain covers in part. `middle`: with or without a hit.
PixelSurface silhouette(const Terrain& terrain, const View& view, double right, double down,
                        const Ray& ray, const Hit& middle) {
  std::array<Ray, static_cast<std::size_t>(parts) * parts> rays;
  std::array<Hit, rays.size()> hits;
  for (int n = 0; n < parts * parts; ++n) {
    const int i = n % parts;
    const int j = n / parts;
    rays[static_cast<std::size_t>(n)] =
        ray_at(view, right + (i + 0.5) / parts, down + (j + 0.5) / parts);
  }
  terrain.meet(rays.data(), static_cast<int>(rays.size()), hits.data());
  PixelSurface sum{0, 0, 0, 0};
  double count = 0;
  for (std::size_t n = 0; n < rays.size(); ++n) {
    if (!is_met(hits[n])) continue;
    const PixelSurface one = surface_at(terrain, rays[n], hits[n]);
    sum.depth += one.depth;
    sum.cosine += one.cosine;
    sum.relief += one.relief;
    sum.normal += one.normal;
    ++count;
  }
  if (count == 0) return {};
  const double coverage = count / static_cast<double>(rays.size());
  if (is_met(middle)) {
    PixelSurface seen = surface_at(terrain, ray, middle);
    seen.coverage = coverage;
    return seen;
  }
  const double length = glm::length(sum.normal);
  const glm::dvec3 normal = length > 0 ? sum.normal / length : glm::dvec3(0);
  return {sum.depth / count, coverage, sum.cosine / count, sum.relief / count, normal};
}

}  // namespace

double relief_of(const glm::dvec3& normal, const glm::dvec3& up, Base base) {
  constexpr double darkest = 0.5;
  constexpr double brightest = 1.35;
  glm::dvec3 east(1, 0, 0);
  if (base == Base::globe) {
    const double across = std::hypot(up.x, up.y);
    if (!(across > 0)) return 1;
    east = glm::dvec3(-up.y, up.x, 0) / across;
  }
  const glm::dvec3 north = glm::cross(up, east);
  const double aside = glm::dot(normal, north) - glm::dot(normal, east);
  return std::clamp(glm::dot(normal, up) + std::sqrt(0.5) * aside, darkest, brightest);
}

void look(const Terrain& terrain, const View& view, double right, double down, int side,
          PixelSurface* pixels) {
  WINDSPLAT_CHECK(side >= 1 && side <= side_max);
  std::array<Ray, rays_max> rays;
  std::array<Hit, rays_max> hits;
  const int corners = (side + 1) * (side + 1);
  for (int n = 0; n < corners; ++n) {
    const int i = n % (side + 1);
    const int j = n / (side + 1);
    rays[static_cast<std::size_t>(n)] = ray_at(view, right + i, down + j);
  }
  for (int n = 0; n < side * side; ++n) {
    const int i = n % side;
    const int j = n / side;
    rays[static_cast<std::size_t>(corners) + static_cast<std::size_t>(n)] =
        ray_at(view, right + i + 0.5, down + j + 0.5);
  }
  terrain.meet(rays.data(), corners + side * side, hits.data());
  for (int n = 0; n < side * side; ++n) {
    const int i = n % side;
    const int j = n / side;
    const int first = j * (side + 1) + i;
    const std::size_t middle = static_cast<std::size_t>(corners) + static_cast<std::size_t>(n);
    int met = is_met(hits[middle]) ? 1 : 0;
    for (const int corner : {first, first + 1, first + side + 1, first + side + 2}) {
      met += is_met(hits[static_cast<std::size_t>(corner)]) ? 1 : 0;
    }
    pixels[n] = {};
    if (met == 5) {
      pixels[n] = surface_at(terrain, rays[middle], hits[middle]);
    } else if (met > 0) {
      pixels[n] = silhouette(terrain, view, right + i, down + j, rays[middle], hits[middle]);
    }
  }
}

PixelSurface combined(const PixelSurface& front, const PixelSurface& behind) {
  if (!(front.coverage > 0)) return behind;
  if (!(behind.coverage > 0)) return front;
  if (front.depth > behind.depth && front.coverage >= 1 && behind.coverage >= 1) return behind;
  PixelSurface one;
  one.depth = front.coverage >= 0.5 ? front.depth : behind.depth;
  one.coverage = std::max(front.coverage, behind.coverage);
  one.cosine = front.coverage * front.cosine + (1 - front.coverage) * behind.cosine;
  one.relief = front.coverage * front.relief + (1 - front.coverage) * behind.relief;
  one.normal = front.coverage >= 0.5 ? front.normal : behind.normal;
  return one;
}

}  // namespace windsplat::terrain
