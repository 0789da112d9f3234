// The body relative to the camera.
#include "server/engine/body.hpp"

#include <algorithm>
#include <glm/geometric.hpp>

namespace windsplat::engine {

kernels::Body make_body(const scene::Scene& scene) {
  kernels::Body to{};
  if (!scene.body) return to;
  const scene::Body& from = *scene.body;
  const glm::dvec3& eye = scene.camera.eye;
  to.shape = from.shape == scene::BodyShape::sphere ? kernels::body_sphere : kernels::body_ground;
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

}  // namespace windsplat::engine
