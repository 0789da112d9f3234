#include "server/light/shade.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>

namespace windsplat::light {

namespace {

double factor_at(const std::shared_ptr<const scene::SampleFactors>& factors, std::size_t sample) {
  return factors ? static_cast<double>((*factors)[sample]) / scene::full_factor : 1;
}

double lit(const scene::Light& light, double sun) {
  return light.ambient + (1 - light.ambient) * std::min(sun, 1.0);
}

}  // namespace

double phase(double anisotropy, double cosine) {
  const double g = anisotropy;
  const double least = (1 - std::abs(g)) * (1 - std::abs(g));
  const double square = std::max(1 + g * g - 2 * g * cosine, least);
  return (1 - g * g) / (square * std::sqrt(square));
}

double sun_seen(const scene::Scene& scene, const std::array<double, 3>& from_eye) {
  const scene::Light& light = *scene.light;
  glm::dvec3 ray = scene.camera.forward;
  if (scene.camera.perspective) {
    ray = {from_eye[0], from_eye[1], from_eye[2]};
    ray /= std::max(glm::length(ray), 1e-15);
  }
  return light.strength * phase(light.anisotropy, glm::dot(ray, light.sun));
}

double medium_light(const scene::Light& light, const scene::ScalarLayer& layer, std::size_t sample,
                    double sun) {
  switch (layer.shading) {
    case scene::Shading::scatter:
      return lit(light, sun * factor_at(light.sunlight, sample));
    case scene::Shading::gradient:
      return layer.relief ? lit(light, factor_at(layer.relief, sample)) : 1;
    case scene::Shading::none:
      break;
  }
  return 1;
}

double line_light(const scene::Light& light, std::size_t sample) {
  return lit(light, light.strength * factor_at(light.sunlight, sample));
}

}  // namespace windsplat::light
