// Curved lattices: each sample has its own position and cell.
#include <gtest/gtest.h>

#include <cmath>

#include "server/engine/reference/reference.hpp"
#include "tests/numerics/naive_renderer.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Scene;

// A medium and lines on 16 x 12 x 6 samples.
Scene flat_scene(bool lines, bool perspective) {
  Scene scene;
  scene.lattice = even_lattice({16, 12, 6}, {0.1, 0.1, 0.1});
  scene.camera = look({0, 0, 0}, {0.4, 0.8, -0.5}, 3, 96, 80, perspective, perspective ? 0.3 : 0.9);
  const auto density = make_volume(scene.lattice, 1, [](int, double x, double y, double z) {
    return static_cast<float>(1 + std::sin(5 * x) * std::cos(4 * y + 3 * z));
  });
  scene.scalars = {medium(density, {0.3F, 0.6F, 1.0F})};
  scene.scalars[0].color = ramp_color(0, 2, {1, 0.4F, 0.1F}, {0.2F, 0.5F, 1});
  if (lines) {
    const auto wind = make_volume(scene.lattice, 3, [](int c, double x, double y, double z) {
      return static_cast<float>(c == 0 ? 1 + y : c == 1 ? std::sin(4 * x) : 0.5 * z);
    });
    scene.vector = plain_lines(wind, {1, 1, 0.2F});
    scene.vector->length = 0.2;
    scene.vector->jitter_center = 0.5;
    scene.vector->jitter_stride = 0.3;
    scene.vector->span = 2;
  }
  scene.stop_transmittance = 0;
  return scene;
}

double rms(const engine::Image& image, const std::vector<double>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double d = static_cast<double>(image.rgba[i]) - truth[i];
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

std::vector<double> truth_of(const Scene& scene) {
  ThreadPool pool(2);
  engine::reference::Options options;
  options.tolerance = 1e-7;
  auto picture = engine::reference::render(scene, pool, CancelToken(), options);
  if (!picture) throw std::runtime_error(picture.error().message);
  return picture->rgba;
}

TEST(Curved, StraightPositionsRenderLikeTheRectilinearLattice) {
  for (const bool perspective : {true, false}) {
    Scene scene = flat_scene(true, perspective);
    scene.method = scene::Method::slab;
    const engine::Rendered flat = render(scene);
    displace(scene.lattice, [](const glm::dvec3& p) { return p; });
    const engine::Rendered curved = render(scene);
    double most = 0;
    for (std::size_t i = 0; i < flat.image.rgba.size(); ++i) {
      most = std::max<double>(most, std::abs(flat.image.rgba[i] - curved.image.rgba[i]));
    }
    EXPECT_LT(most, 2e-3);
    EXPECT_NEAR(static_cast<double>(flat.work.pixel_updates),
                static_cast<double>(curved.work.pixel_updates),
                0.02 * static_cast<double>(flat.work.pixel_updates));
  }
}

TEST(Curved, CurvedLatticesApproachTheReference) {
  const ToWorld shell = [](const glm::dvec3& p) {
    const double r = 0.7 + 0.6 * p.z;
    return glm::dvec3{r * std::cos(1.2 * p.y) * std::sin(2 * p.x),
                      -r * std::cos(1.2 * p.y) * std::cos(2 * p.x), r * std::sin(1.2 * p.y)};
  };
  const ToWorld hills = [](const glm::dvec3& p) {
    return p + glm::dvec3{0, 0, 0.15 * std::sin(3 * p.x) * std::cos(3 * p.y)};
  };
  for (const ToWorld& to_world : {shell, hills}) {
    for (const bool lines : {false, true}) {
      Scene scene = flat_scene(lines, true);
      displace(scene.lattice, to_world);
      const std::vector<double> truth = truth_of(scene);
      scene.method = scene::Method::slab;
      double last = 1;
      for (const double thickness : {1.0, 0.5, 0.25}) {
        scene.slab_thickness = thickness;
        const double error = rms(render(scene).image, truth);
        EXPECT_LT(error, last);
        last = error;
      }
      scene.method = scene::Method::kernel;
    }
  }
}

}  // namespace
}  // namespace windsplat::test
