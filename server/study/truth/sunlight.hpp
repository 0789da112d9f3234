// The light of a scene by brute force, for the integral of server/study/truth/integrator.hpp: from
// the formulas of docs/design/rendering-model.md#light alone.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "server/study/truth/integrator_kernels.hpp"

namespace windsplat::truth {

class Sunlight {
 public:
  // splats: of all media of a scene with a light on a rectilinear lattice.
  Sunlight(const scene::Scene& scene, std::vector<Splat> splats);

  // Mean of the transmittances from the sun to where its ray through a sample enters and leaves the
  // sample's layer of cells.
  [[nodiscard]] Real transmittance(const std::array<int, 3>& sample) const;
  // Optical depth from a place to the sun, through every splat.
  [[nodiscard]] Real depth(const Vec& from) const;

  // Factors of colours at a sample.
  [[nodiscard]] Real of_medium(const scene::ScalarLayer& layer,
                               const std::array<int, 3>& sample) const;
  [[nodiscard]] Real of_line(const std::array<int, 3>& sample) const;
  // Factor of the colour of the ground at a place.
  [[nodiscard]] Real of_ground(const Vec& at) const;

 private:
  [[nodiscard]] Vec place(const std::array<int, 3>& sample) const;

  const scene::Scene& scene_;
  std::vector<Splat> splats_;
  Vec sun_;
};

}  // namespace windsplat::truth
