// Lit scenes by every method against closed forms and the brute-force truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>

#include "server/engine/reference/reference.hpp"
#include "server/light/ground_light.hpp"
#include "server/light/sunlight.hpp"
#include "server/study/truth/integrator.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Method;
using scene::Scene;

void light_up(Scene& scene, const glm::dvec3& sun, double ambient, double strength,
              double anisotropy, double shadows = 1) {
  scene.light = scene::Light{glm::normalize(sun), ambient, strength, anisotropy, shadows, {}};
  scene.light->sunlight = std::make_shared<const scene::SampleFactors>(light::sunlight(
      scene.lattice, light::extinctions(scene.lattice, scene.scalars, shadows), scene.light->sun));
}

light::SunAtPlaces at_samples(const Scene& scene) {
  return {std::make_shared<const surface::Transmittances>(
              surface::Transmittances{scene.lattice.positions, scene.light->sunlight}),
          nullptr, 0};
}

std::vector<double> picture(const Scene& scene, unsigned threads = 1) {
  if (scene.method == Method::reference) {
    ThreadPool pool(threads);
    return engine::reference::render(scene, pool, {}).value().rgba;
  }
  const engine::Image image = render(scene, threads).image;
  return {image.rgba.begin(), image.rgba.end()};
}

// A box seen from the side, lit from above: the light falls off with the depth below its top.
TEST(LitPicture, OfASlabFromTheSideFadesWithDepth) {
  constexpr double sigma = 1.5;
  Scene scene;
  scene.lattice = even_lattice({24, 24, 24}, {2.0 / 24, 2.0 / 24, 2.0 / 24});
  scene.scalars = {medium(uniform(scene.lattice, sigma), {1, 0.5F, 0.25F})};
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 3, 16, 32, false, 1);
  scene.stop_transmittance = 0;
  light_up(scene, {0, 0, 1}, 0.2, 1, 0);
  for (const Method method : {Method::kernel, Method::slab, Method::reference}) {
    scene.method = method;
    const auto rgba = picture(scene);
    for (int y = 3; y < 29; ++y) {
      const double below = (y + 0.5) / 32 * 2;
      const double factor = 0.2 + 0.8 * std::exp(-sigma * below);
      const double* at = rgba.data() + 4 * (16 * y + 8);
      EXPECT_NEAR(at[3], 1 - std::exp(-2 * sigma), 0.01);
      EXPECT_NEAR(at[0] / at[3], factor, 0.01) << y << " method " << static_cast<int>(method);
      EXPECT_NEAR(at[1] / at[3], 0.5 * factor, 0.005);
    }
  }
}

// Clouds and lines with smooth densities.
Scene smooth_scene(bool perspective) {
  Scene scene;
  scene.lattice = even_lattice({14, 12, 10}, {2.0 / 14, 2.0 / 12, 1.6 / 10});
  const auto wave = make_volume(scene.lattice, 1, [](int, double x, double y, double z) {
    return static_cast<float>(1.5 + std::sin(2 * x) + 0.5 * std::cos(2 * y + z));
  });
  scene.scalars = {medium(wave, {1, 0.8F, 0.6F}), medium(wave, {0.2F, 0.4F, 1})};
  scene.scalars.back().shading = scene::Shading::none;
  scene.vector = plain_lines(make_volume(scene.lattice, 3,
                                         [](int c, double x, double y, double) {
                                           return static_cast<float>(c == 0 ? 1 : 0.3 * x * y);
                                         }),
                             {1, 1, 1});
  scene.camera = look({0, 0, 0}, {0.5, 1, -0.4}, perspective ? 3.5 : 4, 24, 20, perspective,
                      perspective ? 0.4 : 1.3);
  scene.stop_transmittance = 0;
  return scene;
}

// A cloud that is thin at the faces of the box, where the medium of the splats has no sharp edge.
TEST(LitPicture, OfASmoothCloudIsThatOfTheBruteForceTruth) {
  for (const bool perspective : {false, true}) {
    Scene scene = smooth_scene(perspective);
    scene.lattice = even_lattice({11, 11, 11}, {2.0 / 11, 2.0 / 11, 2.0 / 11});
    const auto cloud = make_volume(scene.lattice, 1, [](int, double x, double y, double z) {
      return static_cast<float>(2.5 * std::exp(-4 * (x * x + y * y + z * z)));
    });
    scene.scalars = {medium(cloud, {1, 0.8F, 0.6F})};
    scene.vector.reset();
    if (perspective) {
      scene.vector = plain_lines(make_volume(scene.lattice, 3,
                                             [](int c, double x, double y, double) {
                                               return static_cast<float>(c == 0 ? 1 : x * y);
                                             }),
                                 {1, 1, 1});
    }
    scene.camera.width = 10;
    scene.camera.height = 8;
    Scene unlit = scene;
    light_up(scene, {0.4, 0.5, 0.7}, 0.1, 1, perspective ? 0.6 : 0, perspective ? 1.5 : 1);
    const auto truth = truth::integrate(scene, 2);
    const auto unlit_truth = truth::integrate(unlit, 2);
    EXPECT_GT(truth::largest_error(picture(unlit), truth), 0.2);  // the light matters
    for (const Method method : {Method::kernel, Method::slab, Method::reference}) {
      // The order of lines in a splat, which method kernel gets wrong, shows if both differ in
      // light.
      if (perspective && method == Method::kernel) continue;
      scene.method = method;
      unlit.method = method;
      const double own = truth::largest_error(picture(unlit), unlit_truth);
      EXPECT_LT(truth::largest_error(picture(scene), truth), own + 0.015)
          << perspective << " method " << static_cast<int>(method);
    }
  }
}

// A cloud above the ground, seen from above: its shadow lies beside it.
TEST(LitPicture, OfTheGroundHasTheShadowsOfClouds) {
  Scene scene;
  scene.lattice = even_lattice({20, 20, 16}, {0.1, 0.1, 0.1});
  const auto cloud = make_volume(scene.lattice, 1, [](int, double x, double y, double z) {
    const double off = (x - 0.3) * (x - 0.3) + y * y + (z - 0.2) * (z - 0.2);
    return static_cast<float>(12 * std::exp(-12 * off));
  });
  scene.scalars = {medium(cloud, {1, 1, 1})};
  scene.camera = look({0, 0, 0}, {0, 0, -1}, 3, 20, 20, false, 1);
  scene.body.emplace();
  scene.body->shape = scene::BodyShape::ground;
  scene.body->height = scene.lattice.box_min.z;
  scene.body->color = {0.6F, 0.6F, 0.6F};
  light_up(scene, {0.8, 0, 1}, 0.2, 1, 0);
  light::light_ground(scene, at_samples(scene));
  const auto truth = truth::integrate(scene, 2);
  for (const Method method : {Method::kernel, Method::slab, Method::reference}) {
    scene.method = method;
    const auto lit = picture(scene);
    const auto red = [&](int x, int y) { return lit[4 * static_cast<std::size_t>(20 * y + x)]; };
    EXPECT_LT(red(5, 10), 0.35) << "in the shadow";
    EXPECT_GT(red(2, 3), 0.59) << "beside it";
    EXPECT_LT(truth::largest_error(lit, truth), 0.06) << static_cast<int>(method);
  }
}

TEST(LitPicture, OfAGlobeHasADayAndANightSide) {
  Scene scene;
  scene.lattice = even_lattice({4, 4, 4}, {0.5, 0.5, 0.5});
  scene.lattice.inner_radius = 0.8;
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 3, 16, 16, false, 1);
  scene.body.emplace();
  scene.body->radius = 0.8;
  scene.body->color = {1, 1, 1};
  scene.light = scene::Light{{1, 0, 0}, 0.1, 1, 0, 1, {}};
  const auto unlit = picture(scene);
  light::light_ground(scene, {});
  const auto lit = picture(scene);
  const std::size_t row = 16 * 8;
  EXPECT_NEAR(lit[4 * (row + 4)], 0.1 * unlit[4 * (row + 4)], 1e-6);
  EXPECT_GT(lit[4 * (row + 12)], 0.6 * unlit[4 * (row + 12)]);
}

// Only rounding differs from an unlit scene where all light is ambient.
TEST(LitPicture, InAmbientLightAloneIsTheUnlitOne) {
  for (const Method method : {Method::kernel, Method::slab, Method::reference}) {
    Scene scene = smooth_scene(true);
    scene.method = method;
    const auto unlit = picture(scene);
    light_up(scene, {0.4, 0.5, 0.7}, 1, 1, 0.5);
    const auto lit = picture(scene);
    for (std::size_t i = 0; i < lit.size(); ++i) ASSERT_NEAR(lit[i], unlit[i], 1e-6);
  }
}

TEST(LitPicture, OfASunBelowTheHorizonHasAmbientLightOnly) {
  for (const Method method : {Method::kernel, Method::slab, Method::reference}) {
    Scene scene = smooth_scene(true);
    scene.method = method;
    scene.scalars.pop_back();
    const auto unlit = picture(scene);
    light_up(scene, {0.4, 0.5, 0.7}, 0.3, 0, 0.5);
    const auto lit = picture(scene);
    for (std::size_t i = 0; i < lit.size(); ++i) {
      ASSERT_NEAR(lit[i], (i % 4 == 3 ? 1 : 0.3) * unlit[i], 1e-6);
    }
  }
}

TEST(LitPicture, StaysWithinTheUnlitOneForExtremeMediaAndPhases) {
  for (const float extinction : {0.0F, 1e-30F, 1e6F, 1e30F}) {
    for (const double g : {-0.99, 0.99}) {
      for (const bool perspective : {false, true}) {
        Scene scene = smooth_scene(perspective);
        scene.vector.reset();
        scene.scalars = {medium(uniform(scene.lattice, extinction), {1, 1, 1})};
        const auto unlit = picture(scene);
        light_up(scene, -scene.camera.forward, 0.1, 10, g);
        for (const Method method : {Method::kernel, Method::slab}) {
          scene.method = method;
          const auto lit = picture(scene);
          for (std::size_t i = 0; i < lit.size(); ++i) {
            ASSERT_GE(lit[i], 0);
            ASSERT_LE(lit[i], lit[i | 3U] + 1e-6);
          }
        }
        ASSERT_EQ(unlit.size(), 4U * 24 * 20);
      }
    }
  }
}

TEST(LitPicture, IsTheSameForAnyNumberOfThreads) {
  for (const Method method : {Method::kernel, Method::slab}) {
    Scene scene = smooth_scene(true);
    scene.method = method;
    light_up(scene, {0.4, 0.5, 0.7}, 0.1, 2, 0.4);
    EXPECT_EQ(picture(scene, 1), picture(scene, 3));
  }
}

// Light changes colours alone: what is drawn and skipped is the same.
TEST(LitPicture, DrawsTheSameKernels) {
  Scene scene = smooth_scene(true);
  const auto unlit = render(scene).work;
  light_up(scene, {0.4, 0.5, 0.7}, 0.1, 2, 0.4);
  const auto lit = render(scene).work;
  EXPECT_EQ(lit.pixel_updates, unlit.pixel_updates);
  EXPECT_EQ(lit.exponentials, unlit.exponentials);
  EXPECT_EQ(lit.skipped_both, unlit.skipped_both);
  EXPECT_EQ(lit.skipped_bound, unlit.skipped_bound);
}

}  // namespace
}  // namespace windsplat::test
