// The brute-force integral: closed forms, and the reference and the engine compared with it.
#include "server/study/truth/integrator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "tests/numerics/scenes.hpp"
#include "tests/numerics/truth/random_scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Method;
using scene::Scene;

TEST(Truth, KernelProjectsToTheFootprint) {
  constexpr int steps = 200000;
  for (const double b : {0.0, 0.1, 0.3, 0.47, 0.49, 0.8, 1.3, 1.36}) {
    const double half = std::sqrt(1.37 * 1.37 - b * b);
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
      sum += truth::kernel(std::hypot(b, half * (i + 0.5) / steps)) * 2 * half / steps;
    }
    EXPECT_NEAR(sum, footprint(b), 1e-6) << b;
  }
}

TEST(Truth, KernelHasTheVolumeOfTheFootprint) {
  constexpr int steps = 200000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double r = 1.37 * (i + 0.5) / steps;
    sum += 4 * pi * r * r * truth::kernel(r) * 1.37 / steps;
  }
  EXPECT_NEAR(sum, footprint_integral, 1e-6);
}

TEST(Truth, OneSplatIsItsFootprint) {
  Scene scene;
  const glm::dvec3 cell{0.4, 0.7, 0.25};
  scene.lattice = even_lattice({1, 1, 1}, {cell.x, cell.y, cell.z});
  scene.scalars = {medium(uniform(scene.lattice, 3.0F), {1.0F, 0.5F, 0.25F})};
  for (const bool perspective : {false, true}) {
    scene.camera = look({0, 0, 0}, {0.4, 1, -0.6}, 4, 9, 7, perspective, perspective ? 0.3 : 1.2);
    const auto light = truth::integrate(scene);
    for (int y = 0; y < 7; ++y) {
      for (int x = 0; x < 9; ++x) {
        const auto& camera = scene.camera;
        const double size = 2 * camera.half_height / camera.height;
        const glm::dvec3 aside = size * (x - 4) * camera.right + size * (3 - y) * camera.up;
        const glm::dvec3 way = perspective ? camera.forward + aside : camera.forward;
        const glm::dvec3 from = perspective ? camera.eye : camera.eye + aside;
        const glm::dvec3 d = way / cell / glm::length(way);
        const glm::dvec3 o = -from / cell;
        const double r = glm::length(glm::cross(o, d)) / glm::length(d);
        const double tau = 3 * footprint(r) / (footprint_integral * glm::length(d));
        const auto& here = light[static_cast<std::size_t>(9 * y + x)];
        EXPECT_NEAR(here.depth, tau, 1e-7) << x << ' ' << y;
        EXPECT_NEAR(here.rgb[1], -0.5 * std::expm1(-tau), 1e-7);
      }
    }
  }
}

// A ray that begins at the centre of a splat crosses half of it.
TEST(Truth, RaysBeginAtTheNearPlane) {
  Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, {1, 1, 1});
  scene.scalars = {medium(uniform(scene.lattice, 2.0F), {1.0F, 1.0F, 1.0F})};
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 0, 1, 1, true, 0.5);
  scene.camera.near = 0;
  EXPECT_NEAR(truth::integrate(scene)[0].depth, 1 / footprint_integral, 1e-7);
}

TEST(Truth, SelectedPixelsAreThoseOfTheWholePicture) {
  const Scene scene = random_scene(3, false);
  const auto whole = truth::integrate(scene, 4);
  const std::vector<truth::Pixel> pixels{{2, 1}, {7, 5}, {4, 3}};
  const auto some = truth::integrate(scene, pixels, 4);
  ASSERT_EQ(some.size(), pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto& same = whole.at(static_cast<std::size_t>(10 * pixels[i].y + pixels[i].x));
    EXPECT_EQ(some[i].rgb, same.rgb);
    EXPECT_EQ(some[i].alpha, same.alpha);
  }
}

class Judged : public testing::TestWithParam<std::uint32_t> {};

// Random lines and media, straight and curved, in both projections.
TEST_P(Judged, ReferenceEqualsTheTruth) {
  const Scene scene = random_scene(GetParam(), false);
  const auto light = truth::integrate(scene);
  const auto picture = reference_picture(scene);
  EXPECT_LT(truth::largest_error(picture, light), 1e-5) << GetParam();
}

// The opacity of a medium is exact by every method where no kernel reaches the near plane.
TEST_P(Judged, OpacitiesOfMediaEqualTheTruth) {
  Scene scene = random_scene(GetParam(), false);
  scene.vector.reset();
  scene.stop_transmittance = 0;
  const auto light = truth::integrate(scene);
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    const engine::Image image = render(scene).image;
    for (std::size_t i = 0; i < light.size(); ++i) {
      ASSERT_NEAR(image.rgba[4 * i + 3], light[i].alpha, 1e-6) << GetParam() << " pixel " << i;
    }
  }
}

// Slabs composite lines exactly.
TEST_P(Judged, SlabsOfLinesEqualTheTruth) {
  Scene scene = random_scene(GetParam(), false);
  if (!scene.vector) return;
  scene.scalars.clear();
  scene.stop_transmittance = 0;
  scene.method = Method::slab;
  // Positions of lines are rounded to 1e-5 pixels; the error is that times the slope of a ramp.
  EXPECT_LT(truth::largest_error(render(scene).image.rgba, truth::integrate(scene)), 1e-4);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Judged, testing::Range(1U, 21U));

}  // namespace
}  // namespace windsplat::test
