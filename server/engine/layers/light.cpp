#include "server/engine/layers/light.hpp"

#include <cstddef>
#include <glm/geometric.hpp>

#include "server/base/check.hpp"
#include "server/light/shade.hpp"

namespace windsplat::engine {

namespace {

const std::uint16_t* factors_of(const std::shared_ptr<const scene::SampleFactors>& factors,
                                const scene::Lattice& lattice) {
  if (!factors) return nullptr;
  const std::size_t samples = static_cast<std::size_t>(lattice.dims[0]) *
                              static_cast<std::size_t>(lattice.dims[1]) *
                              static_cast<std::size_t>(lattice.dims[2]);
  WINDSPLAT_CHECK(factors->size() == samples);
  return factors->data();
}

}  // namespace

void add_light(const scene::Scene& scene, PassPlan& pass) {
  const scene::Light& from = *scene.light;
  const scene::Camera& camera = scene.camera;
  kernels::Sunlight& to = pass.kernel.light;
  to.lit = 1;
  to.sunlight = factors_of(from.sunlight, scene.lattice);
  to.ambient = static_cast<float>(from.ambient);
  to.strength = static_cast<float>(from.strength);
  to.anisotropy = static_cast<float>(from.anisotropy);
  to.sun[0] = static_cast<float>(glm::dot(from.sun, camera.right));
  to.sun[1] = static_cast<float>(-glm::dot(from.sun, camera.up));
  to.sun[2] = static_cast<float>(glm::dot(from.sun, camera.forward));
  const double phase =
      camera.perspective ? 1 : light::phase(from.anisotropy, glm::dot(from.sun, camera.forward));
  to.media_strength = static_cast<float>(from.strength * phase);
  // A medium of a coarser level has two layers in the pass.
  int layer = 0;
  for (const scene::ScalarLayer* scalar : pass.scalars) {
    const int layers = scalar->field->components == 1 ? 1 : 2;
    for (int n = 0; n < layers; ++n) {
      kernels::MediumLayer& medium = pass.kernel.medium.layer[layer++];
      medium.scatters = scalar->shading == scene::Shading::scatter ? 1 : 0;
      medium.light = medium.scatters != 0 ? to.sunlight : factors_of(scalar->relief, scene.lattice);
    }
  }
}

}  // namespace windsplat::engine
