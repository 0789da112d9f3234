// The body relative to the camera.
#include "server/engine/body.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <glm/geometric.hpp>

#include "server/terrain/terrain_pixel.hpp"

namespace windsplat::engine {

kernels::Body make_body(const scene::Scene& scene) {
  kernels::Body to{};
  if (!scene.body) return to;
  const scene::Body& from = *scene.body;
  const glm::dvec3& eye = scene.camera.eye;
  switch (from.shape) {
    case scene::BodyShape::sphere:
      to.shape = kernels::body_sphere;
      break;
    case scene::BodyShape::ground:
      to.shape = kernels::body_ground;
      break;
    case scene::BodyShape::terrain:
      to.shape = kernels::body_terrain;
      break;
  }
  to.terrain = from.terrain.get();
  to.centre[0] = -glm::dot(eye, scene.camera.right);
  to.centre[1] = glm::dot(eye, scene.camera.up);
  to.centre[2] = -glm::dot(eye, scene.camera.forward);
  to.radius = from.radius;
  const glm::dvec3 low = glm::dvec3(from.low, from.height) - eye;
  const glm::dvec3 high = glm::dvec3(from.high, from.height) - eye;
  for (int a = 0; a < 3; ++a) {
    to.low[a] = low[a];
    to.high[a] = high[a];
  }
  to.pixel = 2.0 * scene.camera.half_height / scene.camera.height;
  std::copy(from.color.begin(), from.color.end(), to.rgb);
  to.ambient = static_cast<float>(scene::body_ambient);
  return to;
}

namespace kernels {

void add_terrain(const Camera& camera, const Body& body, double left, double top,
                 double depth[block_pixels], double coverage[block_pixels],
                 double cosine[block_pixels]) {
  const auto vector = [](const double from[3]) { return glm::dvec3(from[0], from[1], from[2]); };
  const terrain::View view{vector(camera.eye),
                           vector(camera.world_right),
                           vector(camera.world_down),
                           vector(camera.world_forward),
                           body.pixel,
                           static_cast<double>(camera.near),
                           camera.perspective != 0};
  std::array<terrain::PixelSurface, block_pixels> seen;
  static_assert(block_side <= terrain::side_max);
  terrain::look(*body.terrain, view, left - static_cast<double>(camera.half_width_px),
                top - static_cast<double>(camera.half_height_px), block_side, seen.data());
  for (std::size_t l = 0; l < seen.size(); ++l) {
    const auto one = terrain::combined(seen[l], {depth[l], coverage[l], cosine[l]});
    depth[l] = one.depth;
    coverage[l] = one.coverage;
    cosine[l] = one.cosine;
  }
}

}  // namespace kernels

}  // namespace windsplat::engine
