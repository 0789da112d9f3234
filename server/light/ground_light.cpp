#include "server/light/ground_light.hpp"

#include <algorithm>
#include <cstddef>
#include <glm/geometric.hpp>
#include <utility>

namespace windsplat::light {

GroundLight::GroundLight(const scene::Scene& scene,
                         std::shared_ptr<const scene::SampleFactors> ground)
    : light_(*scene.light), globe_(scene.lattice.inner_radius > 0) {
  if (scene.lattice.places) {
    light_.sunlight.reset();
  } else {
    positions_ = scene.lattice.positions;
    if (ground) {
      light_.sunlight = std::move(ground);
      positions_[2] = {scene.lattice.box_min.z};
    }
  }
}

double GroundLight::transmittance(const glm::dvec3& place) const {
  if (globe_) return std::max(0.0, glm::dot(glm::normalize(place), light_.sun));
  if (!light_.sunlight) return 1;
  std::array<std::size_t, 3> low{};
  std::array<std::size_t, 3> next{};
  std::array<double, 3> part{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::vector<double>& at = positions_[a];
    const double x = place[static_cast<glm::length_t>(a)];
    const auto above =
        static_cast<std::size_t>(std::upper_bound(at.begin(), at.end(), x) - at.begin());
    low[a] = above == 0 ? 0 : above - 1;
    next[a] = std::min(above, at.size() - 1);
    if (next[a] > low[a]) part[a] = (x - at[low[a]]) / (at[next[a]] - at[low[a]]);
  }
  double sum = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    double share = 1;
    std::size_t n = 0;
    for (std::size_t a = 3; a-- > 0;) {
      const bool far = (corner >> a & 1U) != 0;
      share *= far ? part[a] : 1 - part[a];
      n = n * positions_[a].size() + (far ? next[a] : low[a]);
    }
    sum += share * static_cast<double>((*light_.sunlight)[n]);
  }
  return sum / scene::full_factor;
}

double GroundLight::factor(const glm::dvec3& place) const {
  const double sun = light_.strength > 0 ? light_.strength * transmittance(place) : 0;
  return light_.ambient + (1 - light_.ambient) * std::min(sun, 1.0);
}

void light_ground(scene::Scene& scene, std::shared_ptr<const scene::SampleFactors> ground) {
  if (!scene.body || !scene.light) return;
  scene.body->light = std::make_shared<const GroundLight>(scene, std::move(ground));
}

}  // namespace windsplat::light
