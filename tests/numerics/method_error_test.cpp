// Errors of each method relative to the integral: slab below kernel, lines alone exact, order in
// slab thickness, and the seam around a line with naive compositing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "server/engine/reference/reference.hpp"
#include "server/frame/difference.hpp"
#include "server/study/scenes.hpp"
#include "server/study/types.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Compositing;
using scene::Method;
using scene::Scene;

// A standard scene of the study at a stride, without occlusion culling.
Scene standard_scene(const char* name, int stride) {
  const study::Subject subject = study::standard_subject(name, true).value();
  study::Setting setting{Method::kernel, Compositing::analytic, study::own_knobs(subject)};
  setting.knobs.stride = stride;
  setting.knobs.stop_transmittance = 0;
  return study::scene_at(subject, setting).value();
}

std::vector<double> integral(const Scene& scene) {
  ThreadPool pool(2);
  auto picture = engine::reference::render(scene, pool, CancelToken(), {1e-8});
  if (!picture) throw std::runtime_error(picture.error().message);
  return std::move(picture->rgba);
}

frame::Difference error_of(Scene scene, Method method, double thickness,
                           const std::vector<double>& truth) {
  scene.method = method;
  scene.slab_thickness = thickness;
  return frame::difference_of(render(scene, 2).image.rgba, truth);
}

TEST(MethodError, OneCellSlabsHaveAtMostAFifthOfTheKernelErrorAtEqualStride) {
  for (const auto& [name, strides] :
       {std::pair{"soft", std::vector{1, 2}}, std::pair{"dense", std::vector{1}}}) {
    for (const int stride : strides) {
      const Scene scene = standard_scene(name, stride);
      const std::vector<double> truth = integral(scene);
      const double kernel = error_of(scene, Method::kernel, 1, truth).rmse;
      const double slab = error_of(scene, Method::slab, 1, truth).rmse;
      EXPECT_GE(kernel, 5 * slab) << name << " at stride " << stride << ": " << slab;
    }
  }
}

// At stride 2 a slab of thickness 1 is twice as deep, which is visible in a dense medium.
TEST(MethodError, StrideOneSlabsHaveAtMostAFifthOfTheErrorInADenseMedium) {
  const Scene scene = standard_scene("dense", 2);
  const std::vector<double> truth = integral(scene);
  EXPECT_GE(error_of(scene, Method::kernel, 1, truth).rmse,
            5 * error_of(scene, Method::slab, 0.5, truth).rmse);
}

// Every line has its own depth in every pixel, independent of slabs.
TEST(MethodError, SlabsOfLinesOnlyEqualTheIntegral) {
  const Scene scene = standard_scene("vectors", 1);
  const std::vector<double> truth = integral(scene);
  for (const double thickness : {2.0, 1.0, 0.37}) {
    EXPECT_LT(error_of(scene, Method::slab, thickness, truth).max, 1e-5) << thickness;
  }
  EXPECT_GT(error_of(scene, Method::kernel, 1, truth).max, 1e-2);
}

TEST(MethodError, SlabsAreSecondOrderInTheirThickness) {
  const Scene scene = standard_scene("soft", 1);
  const std::vector<double> truth = integral(scene);
  const std::vector<double> thickness{2, 1, 0.5};
  std::vector<double> rmse;
  for (const double d : thickness) rmse.push_back(error_of(scene, Method::slab, d, truth).rmse);
  EXPECT_NEAR(study::log_slope(thickness, rmse), 2.0, 0.3);
}

// Cells of medium in a row with optical depth tau each along the middle ray; each contains a line
// through its centre, perpendicular to the view, so that x = 1/2.
Scene cells_with_lines(int cells, double tau, double line_opacity, Compositing compositing) {
  Scene scene;
  scene.lattice = even_lattice({1, cells, 1}, {1, 1, 1});
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 3, 3, 3, false, 0.002);
  scene.compositing = compositing;
  scene.stop_transmittance = 0;
  scene.vector =
      plain_lines(make_volume(scene.lattice, 3,
                              [](int c, double, double, double) { return c == 0 ? 1.0F : 0.0F; }),
                  {0.1F, 0.2F, 0.9F});
  scene.vector->length = 1;
  scene.vector->magnitude_range = {0, 1};
  scene.vector->opacity = line_opacity;
  scene.vector->r1 = 10;
  scene.vector->r2 = 20;
  scene.scalars.push_back(
      medium(make_volume(scene.lattice, 1, [](int, double, double, double) { return 1.0F; }),
             {1.0F, 0.6F, 0.3F}));
  scene.scalars[0].extinction = {{0, tau * footprint_integral}};
  return scene;
}

// Relative loss of the middle pixel, in alpha and in red, where a line of nearly zero opacity
// crosses the medium.
std::array<double, 2> seam(double tau, Compositing compositing, Method method) {
  const Scene with = [&] {
    // Slabs start at the middle of the box: each of the two cells is one slab thick.
    Scene scene = cells_with_lines(method == Method::slab ? 2 : 1, tau, 1e-6, compositing);
    scene.method = method;
    return scene;
  }();
  Scene without = with;
  without.vector.reset();
  const engine::Image crossed = render(with).image;
  const engine::Image plain = render(without).image;
  const float* a = pixel(crossed, 1, 1);
  const float* b = pixel(plain, 1, 1);
  return {1 - static_cast<double>(a[3]) / b[3], 1 - static_cast<double>(a[0]) / b[0]};
}

// Attenuated twice, by x a_s and by (1 - x) a_s: the product of both, x (1 - x) a_s^2, is lost.
TEST(Seam, NaiveLosesUpToAQuarterOfTheMediumAroundAFaintLine) {
  for (const double tau : {0.2, 1.0, 3.0, 100.0}) {
    const double absorbed = -std::expm1(-tau);
    const auto lost = seam(tau, Compositing::cd_naive, Method::kernel);
    EXPECT_NEAR(lost[0], absorbed / 4, 1e-5) << tau;
    EXPECT_NEAR(lost[1], absorbed / 4, 1e-5) << tau;
  }
}

TEST(Seam, CorrectedAndAnalyticHaveNone) {
  for (const Method method : {Method::kernel, Method::slab}) {
    for (const Compositing compositing : {Compositing::cd, Compositing::analytic}) {
      for (const double tau : {0.2, 1.0, 3.0, 100.0}) {
        const auto lost = seam(tau, compositing, method);
        EXPECT_NEAR(lost[0], 0, 1e-5) << study::name_of(compositing) << tau;
        EXPECT_NEAR(lost[1], 0, 1e-5) << study::name_of(compositing) << tau;
      }
    }
  }
}

TEST(Seam, NaiveSlabsShowASeam) {
  EXPECT_GT(seam(3, Compositing::cd_naive, Method::slab)[0], 0.02);
}

}  // namespace
}  // namespace windsplat::test
