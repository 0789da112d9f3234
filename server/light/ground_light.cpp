#include "server/light/ground_light.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <utility>

namespace windsplat::light {

GroundLight::GroundLight(const scene::Scene& scene,
                         std::shared_ptr<const surface::Transmittances> media, double below)
    : light_(*scene.light),
      globe_(scene.lattice.inner_radius > 0),
      media_(std::move(media)),
      below_(below * light_.sun) {}

double GroundLight::factor(const glm::dvec3& place) const {
  double sun = light_.strength;
  if (globe_) sun *= std::max(0.0, glm::dot(glm::normalize(place), light_.sun));
  if (media_ && sun > 0) sun *= media_->at(place - below_);
  return light_.ambient + (1 - light_.ambient) * std::min(sun, 1.0);
}

void light_ground(scene::Scene& scene, const SunAtPlaces& sun) {
  if (!scene.body || !scene.light) return;
  scene.body->light =
      std::make_shared<const GroundLight>(scene, sun.ground ? sun.ground : sun.media, sun.below);
}

void light_surfaces(scene::Scene& scene, const SunAtPlaces& sun) {
  if (!scene.light) return;
  const scene::Light& light = *scene.light;
  const auto on_all = std::make_shared<const surface::Sun>(
      surface::Sun{light.sun, light.ambient, light.strength, sun.media});
  for (surface::Shown& shown : scene.surfaces) {
    const bool section = shown.ambient >= 1;
    if (!section) shown.sun = on_all;
  }
}

}  // namespace windsplat::light
