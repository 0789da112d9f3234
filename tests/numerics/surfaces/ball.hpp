// A surface with a closed form, for tests of drawing and of light.
#pragma once

#include <memory>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/surface/mesh.hpp"
#include "server/surface/shown.hpp"

namespace windsplat::test {

// A sphere about the origin: the isosurface of r^2 on side^3 samples over [-1, 1]^3, of one colour
// and 30 % ambient light. 0 < radius < 1.
inline surface::Shown ball(double radius, double opacity, const surface::Color& color,
                           int side = 33) {
  std::vector<double> at;
  for (int n = 0; n < side; ++n) at.push_back(-1 + 2.0 * n / (side - 1));
  std::vector<float> values;
  for (const double z : at) {
    for (const double y : at) {
      for (const double x : at) values.push_back(static_cast<float>(x * x + y * y + z * z));
    }
  }
  surface::Samples samples;
  samples.dims = {side, side, side};
  samples.positions = {at.data(), at.data(), at.data()};
  surface::Cut cut;
  cut.level = radius * radius;
  cut.values = values.data();
  ThreadPool pool(1);
  surface::Shown shown;
  shown.mesh = std::make_shared<surface::Mesh>(surface::extract(samples, cut, nullptr, pool));
  shown.opacity = opacity;
  shown.colors = {color};
  shown.ambient = 0.3;
  return shown;
}

}  // namespace windsplat::test
