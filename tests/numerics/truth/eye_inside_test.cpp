// The eye within the volume: kernels whose centres lie beside or behind the eye, and yet reach
// beyond the near plane.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "server/study/truth/integrator.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/truth/random_scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Method;
using scene::Scene;

double depth_of(double alpha) { return -std::log1p(-alpha); }

Scene homogeneous(int side, double cell, float rho) {
  Scene scene;
  scene.lattice = even_lattice({side, side, side}, {cell, cell, cell});
  scene.scalars = {medium(uniform(scene.lattice, rho), {1.0F, 0.5F, 0.25F})};
  scene.stop_transmittance = 0;
  return scene;
}

// Optical depths of the middle pixel by the truth, the reference and both methods.
struct Depths {
  double truth = 0, reference = 0, kernel = 0, slab = 0;
};

Depths depths_of(Scene scene) {
  Depths depths;
  depths.truth = truth::integrate(scene)[0].depth;
  depths.reference = depth_of(reference_picture(scene)[3]);
  scene.method = Method::kernel;
  depths.kernel = depth_of(static_cast<double>(render(scene).image.rgba[3]));
  scene.method = Method::slab;
  depths.slab = depth_of(static_cast<double>(render(scene).image.rgba[3]));
  return depths;
}

// Along an axis and obliquely: past samples, faces and edges of cells.
TEST(EyeInside, DepthFollowsTheTruthAsTheEyeMovesThroughAMedium) {
  for (const glm::dvec3& forward : {glm::dvec3{1, 0, 0}, {-0.4, 0.7, 0.2}, {1, 1, 0}}) {
    Scene scene = homogeneous(4, 0.5, 1.0F);
    for (int n = 0; n <= 200; ++n) {
      const glm::dvec3 eye{-1.2 + 0.012 * n, 0.11, 0.07};
      scene.camera = look(eye, forward, 0, 1, 1, true, 0.3);
      scene.camera.near = 0.01;
      const Depths now = depths_of(scene);
      EXPECT_NEAR(now.reference, now.truth, 1e-6) << n;
      EXPECT_NEAR(now.slab, now.truth, 1e-3) << n;
      EXPECT_NEAR(now.kernel, now.truth, 1e-3) << n;
    }
  }
}

// At a sample, on a face, an edge and a corner of its cell, and a hair beside them.
TEST(EyeInside, DepthAtSamplesAndFacesIsThatOfTheTruth) {
  for (const double x : {0.25, 0.25 + 1e-9, 0.25 - 1e-6, 0.25 - 0.01, 0.0, 0.5, 0.5 - 1e-7}) {
    for (const double y : {0.25, 0.0}) {
      for (const glm::dvec3& forward : {glm::dvec3{1, 0, 0}, {0.3, 1, -0.4}}) {
        Scene scene = homogeneous(4, 0.5, 1.0F);
        scene.camera = look({x, y, 0.25}, forward, 0, 1, 1, true, 0.3);
        scene.camera.near = 0.01;
        const Depths depths = depths_of(scene);
        EXPECT_NEAR(depths.reference, depths.truth, 1e-6) << x << ' ' << y;
        EXPECT_NEAR(depths.slab, depths.truth, 1e-3) << x << ' ' << y;
        EXPECT_NEAR(depths.kernel, depths.truth, 1e-3) << x << ' ' << y;
      }
    }
  }
}

// A line behind the eye that ends in front of it.
TEST(EyeInside, LineThatPassesTheEyeIsDrawn) {
  Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, {0.5, 0.5, 0.5});
  const auto along = make_volume(
      scene.lattice, 3, [](int c, double, double, double) { return c == 1 ? 1.0F : 0.0F; });
  scene.vector = plain_lines(along, {1.0F, 0.5F, 0.2F});
  scene.vector->length = 2;
  scene.vector->r1 = 2;
  scene.vector->r2 = 3;
  scene.camera = look({0, 0.4, 0.05}, {0, 1, 0}, 0, 21, 21, true, 0.5);
  const auto light = truth::integrate(scene);
  double brightest = 0;
  for (const auto& pixel : light) brightest = std::max(brightest, pixel.alpha);
  EXPECT_NEAR(brightest, 0.8, 1e-6);
  EXPECT_LT(truth::largest_error(reference_picture(scene), light), 1e-6);
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    EXPECT_LT(truth::largest_error(render(scene).image.rgba, light), 2e-3);
  }
}

class AnyEye : public testing::TestWithParam<std::uint32_t> {};

TEST_P(AnyEye, ReferenceEqualsTheTruth) {
  const Scene scene = random_scene(GetParam(), true);
  const auto light = truth::integrate(scene);
  EXPECT_LT(truth::largest_error(reference_picture(scene), light), 3e-5);
}

// Lines alone: a slab composites them exactly.
TEST_P(AnyEye, LinesAroundTheEyeEqualTheTruth) {
  Scene scene = random_scene(GetParam(), true);
  scene.scalars.clear();
  if (!scene.vector) return;
  scene.method = Method::slab;
  scene.stop_transmittance = 0;
  const auto light = truth::integrate(scene);
  // A position error of 1e-5 pixels times the slope of the edge of a line.
  EXPECT_LT(truth::largest_error(render(scene).image.rgba, light), 1e-3);
}

// Media alone: only the part of kernels at the near plane is interpolated.
TEST_P(AnyEye, DepthsAroundTheEyeAreThoseOfTheTruth) {
  Scene scene = random_scene(GetParam(), true);
  scene.vector.reset();
  if (scene.scalars.empty()) return;
  scene.stop_transmittance = 0;
  const auto light = truth::integrate(scene);
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    const engine::Image image = render(scene).image;
    for (std::size_t i = 0; i < light.size(); ++i) {
      EXPECT_NEAR(image.rgba[4 * i + 3], light[i].alpha, 1e-3)
          << "pixel " << i << " method " << static_cast<int>(method);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, AnyEye, testing::Range(1U, 31U));

}  // namespace
}  // namespace windsplat::test
