// Sunlight on the opaque body of a scene.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "server/scene/scene.hpp"

namespace windsplat::light {

// On a rectilinear lattice the transmittance from the sun to the ground, or else of the samples,
// interpolated linearly, and that of the nearest ones beyond the outermost: shadows of media lie on
// the ground. On a globe the cosine between the sun and the vertical, 0 at night. On other curved
// lattices full sunlight.
class GroundLight {
 public:
  // scene: with light. ground: of ground_sunlight(), on the lattice of the scene; null: that of the
  // samples.
  explicit GroundLight(const scene::Scene& scene,
                       std::shared_ptr<const scene::SampleFactors> ground = nullptr);

  // Factor of the colour of the body at a place in the world, at most 1.
  [[nodiscard]] double factor(const glm::dvec3& place) const;

 private:
  [[nodiscard]] double transmittance(const glm::dvec3& place) const;

  scene::Light light_;
  bool globe_ = false;
  std::array<std::vector<double>, 3> positions_;  // of the factors
};

// Lights the body of a scene that has a body and light. ground: as of GroundLight.
void light_ground(scene::Scene& scene,
                  std::shared_ptr<const scene::SampleFactors> ground = nullptr);

}  // namespace windsplat::light
