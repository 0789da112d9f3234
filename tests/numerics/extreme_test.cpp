// Stiff and extreme scenes with known pictures.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "server/engine/reference/reference.hpp"
#include "tests/numerics/partial_footprint.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

// A line across the middle of a splat, tilted so that its right end leaves the back of the cell;
// red medium, blue line.
scene::Scene line_in_cell(float rho, double opacity, float away) {
  scene::Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, {2, 2, 2});
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 5, 41, 41, false, 1.025);
  scene.vector = plain_lines(make_volume(scene.lattice, 3,
                                         [=](int c, double, double, double) {
                                           if (c == 2) return 0.0F;
                                           return c == 0 ? 1.0F : away;
                                         }),
                             {0.0F, 0.25F, 1.0F});
  scene.vector->length = 6;
  scene.vector->r1 = 3;
  scene.vector->r2 = 4;
  scene.vector->opacity = opacity;
  scene.scalars.push_back(medium(uniform(scene.lattice, rho), {1.0F, 0.5F, 0.0F}));
  return scene;
}

// Largest difference of colours from the reference; NaN counts as infinite.
double worst_error(const scene::Scene& scene) {
  const engine::Image image = render(scene).image;
  ThreadPool pool(2);
  const auto truth = engine::reference::render(scene, pool, CancelToken());
  if (!truth) return 1e300;
  double worst = 0;
  for (std::size_t i = 0; i < truth->rgba.size(); ++i) {
    const double error = std::abs(static_cast<double>(image.rgba[i]) - truth->rgba[i]);
    worst = std::isfinite(error) ? std::max(worst, error) : 1e300;
  }
  return worst;
}

TEST(Stiff, OpaqueCellHidesLinesBehindItOnly) {
  for (const float rho : {1e4F, 1e10F, 1e30F, 3e38F, infinity}) {
    scene::Scene scene = line_in_cell(1, 0.8, 2.0F);
    scene.scalars[0].extinction = {{0, static_cast<double>(rho)}, {2, static_cast<double>(rho)}};
    const engine::Image image = render(scene).image;
    for (const float v : image.rgba) ASSERT_TRUE(std::isfinite(v)) << rho;
    const float* behind = pixel(image, 30, 20);
    EXPECT_EQ(behind[0], 1.0F) << rho;
    EXPECT_EQ(behind[1], 0.5F) << rho;
    EXPECT_EQ(behind[2], 0.0F) << rho;
    EXPECT_EQ(behind[3], 1.0F) << rho;
    const float* before = pixel(image, 9, 20);  // at the front of its cell
    EXPECT_NEAR(before[2], 0.8, 1e-6) << rho;
    EXPECT_NEAR(before[0], 0.2, 1e-6) << rho;
    EXPECT_EQ(before[3], 1.0F) << rho;
  }
}

TEST(Stiff, OpaqueLineEndsTheRay) {
  for (const float rho : {0.0F, 1e-30F, 1.0F, 50.0F, 1e30F}) {
    const engine::Image image = render(line_in_cell(rho, 1, 0.0F)).image;
    const float* middle = pixel(image, 20, 20);
    EXPECT_EQ(middle[3], 1.0F) << rho;
    const double passed = std::exp(-static_cast<double>(rho) / footprint_integral);
    EXPECT_NEAR(middle[0], 1 - passed, 1e-6) << rho;  // half of its cell is in front of it
    EXPECT_NEAR(middle[2], passed, 1e-6) << rho;
  }
}

// For a single kernel with a line in its middle the method is exact.
TEST(Stiff, OneKernelWithACentralLineEqualsTheReference) {
  for (const float rho : {0.0F, 1e-30F, 1e-3F, 1.0F, 50.0F, 1e4F, 1e30F}) {
    EXPECT_LT(worst_error(line_in_cell(rho, 0.8, 0.0F)), 1e-5) << rho;
  }
}

scene::Scene small_scene(const scene::Lattice& lattice, float wind, float rho) {
  scene::Scene scene;
  scene.lattice = lattice;
  const auto w = make_volume(
      lattice, 3, [=](int, double x, double, double) { return wind * static_cast<float>(1 + x); });
  const auto s = make_volume(
      lattice, 1, [=](int, double, double y, double) { return rho * static_cast<float>(1.5 + y); });
  scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 3, 48, 36, true, 0.3);
  scene.vector = plain_lines(w, {1.0F, 0.5F, 0.2F});
  scene.vector->length = 0.3;
  scene.scalars.push_back(medium(s, {0.2F, 0.5F, 1.0F}));
  return scene;
}

#if defined(__SSE__)
TEST(Extremes, DenormalsRenderTheSameFlushedOrNot) {
  for (const float tiny : {1e-45F, 1e-41F, 1e-38F}) {
    const scene::Scene scene =
        small_scene(even_lattice({5, 5, 5}, {0.3, 0.3, 0.3}), tiny, 1e3F * tiny);
    const unsigned before = _mm_getcsr();
    _mm_setcsr(before & ~0x8040U);
    const engine::Image kept = render(scene).image;
    _mm_setcsr(before | 0x8040U);
    const engine::Image flushed = render(scene).image;
    _mm_setcsr(before);
    EXPECT_EQ(kept.rgba, flushed.rgba) << tiny;
  }
}
#endif

TEST(Extremes, KernelThatCoversTheScreenEqualsItsFootprint) {
  scene::Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, {2, 2, 2});
  scene.scalars.push_back(medium(uniform(scene.lattice, 0.8F), {1.0F, 0.5F, 0.25F}));
  for (const double distance : {3.0, 0.3}) {
    scene.camera = look({0, 0, 0}, {0.2, 1, -0.1}, distance, 130, 70, true, 0.05);
    const engine::Image image = render(scene).image;
    for (int y = 0; y < 70; y += 7) {
      for (int x = 0; x < 130; x += 7) {
        const double size = 0.1 / 70;
        const double off = std::hypot((x + 0.5 - 65) * size, (y + 0.5 - 35) * size);
        const double ray = std::hypot(1.0, off);
        const double r = distance * off / ray / 2;
        ASSERT_LT(r, 0.48);
        // For a kernel that contains the eye, only the part beyond the near plane counts.
        const double near = (scene.camera.near - distance / (ray * ray)) * ray / 2;
        const double beyond = footprint(r) - partial_footprint(r, near);
        const double tau = 0.8 * beyond * 2 / footprint_integral;
        // The error of the engine's partial footprints near the centre is 2e-4 RMS.
        const double whole = 0.8 * footprint(r) * 2 / footprint_integral;
        const double error = distance < 1 ? 3e-4 * whole * std::exp(-tau) : 1e-4;
        ASSERT_NEAR(pixel(image, x, y)[3], -std::expm1(-tau), error) << distance;
      }
    }
  }
}

TEST(Extremes, VeryFarEyeRendersLikeANearOne) {
  scene::Scene scene = small_scene(even_lattice({6, 5, 4}, {0.3, 0.3, 0.3}), 1.0F, 2.0F);
  scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 4, 64, 48, false, 1);
  const engine::Image near = render(scene).image;
  scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 1e5, 64, 48, false, 1);
  const engine::Image far = render(scene).image;
  // With a field of view that narrows as the eye recedes, perspective converges to orthographic.
  scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 1e5, 64, 48, true, 1e-5);
  const engine::Image narrow = render(scene).image;
  float brightest = 0;
  for (std::size_t i = 0; i < near.rgba.size(); ++i) {
    ASSERT_NEAR(near.rgba[i], far.rgba[i], 1e-5);
    // A position error of 1e-5 times the slope of the edge of the line.
    ASSERT_NEAR(near.rgba[i], narrow.rgba[i], 5e-3);
    brightest = std::max(brightest, near.rgba[i]);
  }
  EXPECT_GT(brightest, 0.3F);
}

// Optical depths of a column add up to tau = 2; accumulation in float deviates by at most 8e-3.
TEST(Extremes, MillionLayersAddUp) {
  for (const int layers : {1000, 100000, 1000000}) {
    scene::Scene scene;
    scene.lattice = even_lattice({1, 1, layers}, {1, 1, 2.0 / layers});
    scene.camera = look({0, 0, 0}, {0, 0, -1}, 3, 1, 1, false, 0.01);
    scene.scalars.push_back(
        medium(uniform(scene.lattice, static_cast<float>(footprint_integral)), {1.0F, 0.5F, 0.0F}));
    scene.stop_transmittance = 0;
    const engine::Image image = render(scene).image;
    EXPECT_NEAR(image.rgba[3], -std::expm1(-2.0), 8e-3) << layers;
    EXPECT_NEAR(image.rgba[0], -std::expm1(-2.0), 8e-3) << layers;
  }
}

TEST(Extremes, ConstantFieldHasTheFirstColorOfTheTable) {
  scene::Scene scene = small_scene(even_lattice({1, 1, 1}, {2, 2, 2}), 1.0F, 1.0F);
  scene.scalars[0] = medium(uniform(scene.lattice, 3.0F), {0, 0, 0});
  scene.scalars[0].color = ramp_color(3, 3, {0.5F, 0.25F, 1.0F}, {1.0F, 0.0F, 0.0F});
  scene.vector->magnitude_range = {std::sqrt(3.0), std::sqrt(3.0)};
  scene.vector->magnitude_intensity = 0.6;
  scene.vector->color = ramp_color(2, 2, {0.25F, 0.5F, 0.75F}, {1.0F, 1.0F, 1.0F});
  scene.vector->color_by = scene::LineColor::magnitude;
  const engine::Image image = render(scene).image;
  for (const float v : image.rgba) ASSERT_TRUE(std::isfinite(v));
  EXPECT_LT(worst_error(scene), 0.3);
  scene.vector.reset();
  const engine::Image cloud = render(scene).image;
  const float* middle = pixel(cloud, 24, 18);
  EXPECT_GT(middle[3], 0.9F);
  EXPECT_NEAR(middle[0], 0.5F * middle[3], 1e-6);
  EXPECT_NEAR(middle[2], middle[3], 1e-6);
}

TEST(Extremes, CellFlattenedAMillionTimesIsCorrect) {
  for (const auto& cell :
       {glm::dvec3(2e-6, 2, 2), glm::dvec3(2, 2e-6, 2), glm::dvec3(2, 2, 2e-6)}) {
    scene::Scene scene;
    scene.lattice = even_lattice({1, 1, 1}, {cell.x, cell.y, cell.z});
    scene.scalars.push_back(medium(uniform(scene.lattice, 1e6F), {1.0F, 0.5F, 0.25F}));
    for (const bool perspective : {false, true}) {
      scene.camera = look({0, 0, 0}, {0.3, 1, -0.4}, 4, 33, 33, perspective, perspective ? 0.3 : 1);
      EXPECT_LT(worst_error(scene), 2e-3) << cell.x << " " << cell.y << " " << cell.z;
    }
  }
}

TEST(Extremes, EyeInsideTheVolumeGivesAFinitePictureNearTheReference) {
  scene::Scene scene = small_scene(even_lattice({12, 12, 12}, {0.15, 0.15, 0.15}), 1.0F, 2.0F);
  scene.vector->length = 0.1;
  scene.camera = look({0.013, 0.004, 0.009}, {0.3, 1, -0.4}, 0, 40, 30, true, 1);
  scene.camera.near = 0.05;
  // The engine keeps or drops whole splats at the eye: an error of a few cells of rho h = 0.4.
  EXPECT_LT(worst_error(scene), 0.35);
}

TEST(Extremes, PictureOfTheMaximumSize) {
  scene::Scene scene = small_scene(even_lattice({3, 3, 3}, {0.3, 0.3, 0.3}), 1.0F, 2.0F);
  for (const auto& size : {std::array<int, 2>{4096, 4096}, {8192, 1}, {1, 8192}}) {
    scene.camera.width = size[0];
    scene.camera.height = size[1];
    const engine::Image image = render(scene, 2).image;
    ASSERT_EQ(image.rgba.size(), 4UL * size[0] * size[1]);
    double alpha = 0;
    bool finite = true;
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) {
      finite = finite && std::isfinite(image.rgba[i]);
      alpha = std::max<double>(alpha, image.rgba[i]);
    }
    EXPECT_TRUE(finite);
    EXPECT_GT(alpha, 0.3) << size[0];
  }
}

}  // namespace
}  // namespace windsplat::test
