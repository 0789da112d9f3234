// Scene -> the rendering integral of each pixel by brute force: the ground truth of the tests and
// of `windsplat study --extremes`. It shares no code with the engine or its reference, follows the
// formulas of docs/design/rendering-model.md alone, and tests every ray against every kernel.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "server/scene/scene.hpp"

namespace windsplat::truth {

// Premultiplied linear light of one ray. depth: optical depth of the medium alone, which resolves
// media that alpha does not.
struct Light {
  std::array<double, 3> rgb{};
  double alpha = 0;
  double depth = 0;
  bool body = false;  // it ends at the body
};

struct Pixel {
  int x = 0, y = 0;
};

// One entry per pixel. The method, compositing, stop_transmittance and tolerance of optical depth
// of the scene are ignored. A body has sharp edges: pixels that it covers in part differ. `steps`:
// intervals between two places where a kernel begins or ends or a line is met; colours converge
// with its square, optical depths much faster (1e-9). Opaque intervals are divided further. Curved
// lattices must have two samples or more along every axis.
std::vector<Light> integrate(const scene::Scene& scene, std::span<const Pixel> pixels,
                             int steps = 16);
// Every pixel, row 0 on top.
std::vector<Light> integrate(const scene::Scene& scene, int steps = 16);

// The 3-D kernel of a splat at a distance of r cells; its integral over space is the constant C.
double kernel(double r);

// Largest difference of a colour or alpha; NaN counts as infinite.
template <class Real>
double largest_error(const std::vector<Real>& rgba, const std::vector<Light>& truth) {
  double most = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    for (std::size_t c = 0; c < 4; ++c) {
      const double expected = c < 3 ? truth[i].rgb[c] : truth[i].alpha;
      const double error = static_cast<double>(rgba[4 * i + c]) - expected;
      most = error == error ? std::max(most, error < 0 ? -error : error) : 1e300;
    }
  }
  return most;
}

}  // namespace windsplat::truth
