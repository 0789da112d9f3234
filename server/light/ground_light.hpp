// Sunlight on the opaque body of a scene.
#pragma once

#include <glm/vec3.hpp>
#include <memory>

#include "server/scene/scene.hpp"
#include "server/surface/transmittances.hpp"

namespace windsplat::light {

// The brightness of the ground is ambient + (1 - ambient) min(1, strength T), on a globe with the
// cosine between the sun and the vertical as another factor of T: 0 at night.
class GroundLight {
 public:
  // scene: with light. media: the transmittance from the sun to places; null: 1. It is taken by
  // `below` world units further along the rays.
  explicit GroundLight(const scene::Scene& scene,
                       std::shared_ptr<const surface::Transmittances> media = nullptr,
                       double below = 0);

  // Factor of the colour of the body at a place in the world, at most 1.
  [[nodiscard]] double factor(const glm::dvec3& place) const;
  // Null: 1 everywhere.
  [[nodiscard]] const surface::Transmittances* transmittances() const { return media_.get(); }

 private:
  scene::Light light_;
  bool globe_ = false;
  std::shared_ptr<const surface::Transmittances> media_;
  glm::dvec3 below_{0};
};

// Transmittances from the sun to places.
struct SunAtPlaces {
  std::shared_ptr<const surface::Transmittances> media;   // null: 1
  std::shared_ptr<const surface::Transmittances> ground;  // at the ground; null: `media`
  double below = 0;                                       // as of GroundLight, for the ground
};

// Lights the body of a scene that has a body and light.
void light_ground(scene::Scene& scene, const SunAtPlaces& sun);
// Lights its isosurfaces; sections, whose colours are read by a legend, keep theirs.
void light_surfaces(scene::Scene& scene, const SunAtPlaces& sun);

}  // namespace windsplat::light
