// Physics of the medium: absorption of a splat and of a lattice of splats.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "server/study/truth/integrator.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

scene::Scene one_splat(double rho, const std::array<double, 3>& spacing, const glm::dvec3& forward,
                       bool perspective) {
  scene::Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, spacing);
  scene.camera = look({0, 0, 0}, forward, 4, 63, 63, perspective, perspective ? 0.3 : 1.2);
  scene.scalars.push_back(
      medium(uniform(scene.lattice, static_cast<float>(rho)), {1.0F, 0.5F, 0.25F}));
  scene.stop_transmittance = 0;
  return scene;
}

TEST(Footprint, IntegralOverThePlane) {
  constexpr int steps = 1000000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double r = 1.37 * (i + 0.5) / steps;
    sum += 2 * pi * r * footprint(r) * 1.37 / steps;
  }
  EXPECT_NEAR(sum, footprint_integral, 1e-9);
}

// Compares every pixel of one_splat(rho, spacing, ...) with the formula.
void expect_footprint(const scene::Scene& scene, double rho, const std::array<double, 3>& spacing) {
  const engine::Image image = render(scene).image;
  const auto& camera = scene.camera;
  const double size = 2 * camera.half_height / camera.height;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double X = (x + 0.5 - 31.5) * size;
      const double Y = (31.5 - (y + 0.5)) * size;
      glm::dvec3 ray = camera.forward;
      glm::dvec3 from = camera.eye;
      (camera.perspective ? ray : from) += X * camera.right + Y * camera.up;
      ray = glm::normalize(ray);
      const glm::dvec3 cell{spacing[0], spacing[1], spacing[2]};
      const glm::dvec3 d = ray / cell;
      const glm::dvec3 o = -from / cell;
      const double r = glm::length(glm::cross(o, d)) / glm::length(d);
      const double tau = rho * footprint(r) / (footprint_integral * glm::length(d));
      const double alpha = -std::expm1(-tau);
      ASSERT_NEAR(pixel(image, x, y)[3], alpha, 2e-6) << x << " " << y;
      ASSERT_NEAR(pixel(image, x, y)[1], 0.5 * alpha, 1e-6);
    }
  }
}

TEST(Splat, AbsorbsByItsFootprintInAnisotropicCells) {
  const std::array<double, 3> spacing{0.4, 0.7, 0.25};
  for (const bool perspective : {false, true}) {
    expect_footprint(one_splat(3, spacing, {0.4, 1, -0.6}, perspective), 3, spacing);
  }
}

// Cells from a fraction of a pixel to some pixels, of which some are so flat that rays to
// neighbouring pixels cross them at very different angles.
TEST(Splat, AbsorbsByItsFootprintInFlatAndDistantCells) {
  for (const std::array<double, 3>& spacing :
       {std::array{0.4, 0.4, 0.003}, std::array{0.2, 0.2, 0.05}, std::array{0.01, 0.3, 0.3},
        std::array{0.1, 0.1, 0.1}, std::array{0.01, 0.01, 0.01}}) {
    for (const glm::dvec3& forward :
         {glm::dvec3{0, 1, 0}, glm::dvec3{0.4, 1, -0.05}, glm::dvec3{0.4, 1, -0.6}}) {
      SCOPED_TRACE(testing::Message() << spacing[0] << " " << spacing[1] << " " << spacing[2]
                                      << ", " << forward.x << " " << forward.y << " " << forward.z);
      scene::Scene scene = one_splat(3, spacing, forward, true);
      scene.scalars[0].min_optical_depth = 0;
      expect_footprint(scene, 3, spacing);
    }
  }
}

TEST(Splat, OpticalDepthFromNearZeroToInfinity) {
  const auto centre = [](double rho) {
    const engine::Image image = render(one_splat(rho, {1, 1, 1}, {0, 1, 0}, false)).image;
    return std::array<float, 2>{pixel(image, 31, 31)[0], pixel(image, 31, 31)[3]};
  };
  // Colour accumulates from zero; alpha is one minus the transmittance.
  const double faint = 1e-30;
  EXPECT_NEAR(centre(faint)[0] / (faint / footprint_integral), 1, 1e-6);
  EXPECT_NEAR(centre(faint)[1], 0, 6e-8);
  EXPECT_NEAR(centre(1e-4)[1] / (1e-4 / footprint_integral), 1, 1e-3);
  EXPECT_NEAR(centre(1)[1], -std::expm1(-1 / footprint_integral), 2e-7);
  for (const double rho : {100.0, 1e4, 1e30}) {
    EXPECT_EQ(centre(rho)[1], 1.0F);
    EXPECT_EQ(centre(rho)[0], 1.0F);
  }
}

TEST(Splat, ZeroOpticalDepthLeavesThePixelUnchanged) {
  scene::Scene scene = one_splat(2, {1, 1, 1}, {0, 1, 0}, true);
  const engine::Image before = render(scene).image;
  scene.scalars.push_back(medium(uniform(scene.lattice, 0.0F), {0.3F, 1.0F, 1.0F}));
  EXPECT_EQ(before.rgba, render(scene).image.rgba);
}

// Relative deviation of the optical depth from rho L, over pixels whose rays cross the whole slab.
struct Ripple {
  double peak_to_peak = 0, rms = 0, mean = 0;
};

Ripple ripple(const glm::dvec3& forward) {
  scene::Scene scene;
  constexpr int layers = 19;
  scene.lattice = even_lattice({72, 72, layers}, {1, 1, 1});
  scene.camera = look({0, 0, 0}, forward, 100, 48, 48, false, 3.1);
  const double length = layers / std::abs(glm::normalize(forward).z);
  const double rho = 1 / length;
  scene.scalars.push_back(
      medium(uniform(scene.lattice, static_cast<float>(rho)), {1.0F, 1.0F, 1.0F}));
  scene.stop_transmittance = 0;
  const engine::Image image = render(scene).image;
  double low = 1e9;
  double high = -1e9;
  double sum = 0;
  double square = 0;
  const int pixels = image.width * image.height;
  for (int i = 0; i < pixels; ++i) {
    const double deviation = -std::log1p(-static_cast<double>(image.rgba[4 * i + 3])) - 1;
    low = std::min(low, deviation);
    high = std::max(high, deviation);
    sum += deviation;
    square += deviation * deviation;
  }
  const double mean = sum / pixels;
  return {high - low, std::sqrt(square / pixels - mean * mean), mean};
}

TEST(UniformMedium, AbsorbsOneMinusExpWithinTheFootprintsRipple) {
  // The ripple of the overlapping footprints on a unit lattice: 1.0 % peak to peak and 0.25 % rms
  // along an axis, 3.9 % and 0.9 % at 45 degrees, about 0.1 % at generic angles.
  const Ripple axis = ripple({0, 0, -1});
  EXPECT_LE(axis.peak_to_peak, 0.0105);
  EXPECT_LE(axis.rms, 0.0030);
  EXPECT_NEAR(axis.mean, 0, 0.002);
  const Ripple diagonal = ripple({1, 0, -1});
  EXPECT_LE(diagonal.peak_to_peak, 0.040);
  EXPECT_LE(diagonal.rms, 0.0105);
  EXPECT_NEAR(diagonal.mean, 0, 0.004);
  const Ripple generic = ripple({0.31, 0.17, -1});
  EXPECT_LE(generic.peak_to_peak, 0.01);
  EXPECT_LE(generic.rms, 0.002);
  EXPECT_NEAR(generic.mean, 0, 0.002);
}

TEST(UniformMedium, StrideOfTwoAbsorbsTheSame) {
  scene::Scene scene;
  scene.lattice = even_lattice({40, 40, 16}, {1, 1, 1});
  scene.camera = look({0, 0, 0}, {0.31, 0.17, -1}, 100, 32, 32, false, 3);
  scene.scalars.push_back(medium(uniform(scene.lattice, 0.05F), {1.0F, 1.0F, 1.0F}));
  const double length = 16 / std::abs(scene.camera.forward.z);
  for (const int stride : {1, 2}) {
    scene.scalars[0].stride = stride;
    const engine::Image image = render(scene).image;
    for (int i = 0; i < 32 * 32; ++i) {
      EXPECT_NEAR(image.rgba[4 * i + 3], -std::expm1(-0.05 * length), 0.01) << stride;
    }
  }
}

// Along z the optical depth of a splat is that of its whole cell; for any number of layers per
// kernel position the mean over a cell is extinction times thickness.
TEST(UniformMedium, AnyStrideAbsorbsLikeTheBox) {
  for (const int layers : {1, 3, 19}) {
    for (const int stride : {1, 2, 4, 8}) {
      scene::Scene scene;
      scene.lattice = even_lattice({72, 72, layers}, {1, 1, 1});
      scene.camera = look({0, 0, 0}, {0, 0, -1}, 100, 32, 32, false, 8);
      scene.scalars.push_back(medium(uniform(scene.lattice, 0.05F), {1.0F, 1.0F, 1.0F}));
      scene.scalars[0].stride = stride;
      const engine::Image image = render(scene).image;
      double sum = 0;
      for (int i = 0; i < 32 * 32; ++i) {
        sum -= std::log1p(-static_cast<double>(image.rgba[4 * i + 3]));
      }
      EXPECT_NEAR(sum / (32 * 32) / (0.05 * layers), 1, 0.01) << layers << " by " << stride;
    }
  }
}

// Colours accumulate from zero, so that those of the thinnest medium are exact; opacity is one
// minus a transmittance, and each update of a pixel rounds it by 1e-7 at most
// (docs/design/engine.md).
TEST(Media, ThinMediaLoseAtMostTheRoundingOfTheirUpdates) {
  constexpr int layers = 300;
  constexpr double unit = 1e-3;  // optical depth of a layer
  scene::Scene scene;
  scene.lattice = even_lattice({3, 3, layers}, {0.5, 0.5, 0.002});
  scene.camera = look({0.1, 0.05, 0}, {0, 0, -1}, 3, 3, 3, false, 0.3);
  scene.stop_transmittance = 0;
  const auto set_layer_depth = [&](double depth) {
    const auto rho = static_cast<float>(depth / 0.002);
    scene.scalars = {medium(uniform(scene.lattice, rho), {1.0F, 0.5F, 0.25F})};
  };
  set_layer_depth(unit);
  const auto light = truth::integrate(scene, 4);
  for (const double each : {1e-12, 1e-9, 3e-8, 1e-6}) {
    set_layer_depth(each);
    for (const scene::Method method : {scene::Method::kernel, scene::Method::slab}) {
      scene.method = method;
      const engine::Rendered rendered = render(scene);
      double lost = 0;
      for (std::size_t i = 0; i < light.size(); ++i) {
        EXPECT_NEAR(light[i].depth, layers * unit, 0.1 * layers * unit) << "it is homogeneous";
        // Optical depth is proportional to extinction, and the medium has one colour.
        const double alpha = -std::expm1(-light[i].depth * each / unit);
        EXPECT_NEAR(rendered.image.rgba[4 * i] / alpha, 1, 1e-3) << each;
        lost += std::abs(rendered.image.rgba[4 * i + 3] - alpha);
      }
      EXPECT_LE(lost, 1e-7 * static_cast<double>(rendered.work.pixel_updates)) << each;
    }
  }
}

// Also where the eye lies in the medium.
TEST(Media, ColorsOfAnyExtinctionEqualTheTruth) {
  for (const float rho : {1e-24F, 1e-12F, 1e-3F, 1.0F, 1e3F, 1e12F, 1e30F}) {
    for (const double distance : {4.0, 0.0}) {
      scene::Scene scene;
      scene.lattice = even_lattice({3, 3, 3}, {0.5, 0.4, 0.3});
      scene.camera = look({0.1, 0.05, 0}, {0.3, 1, -0.2}, distance, 12, 9, true, 0.3);
      scene.scalars = {medium(uniform(scene.lattice, rho), {1.0F, 0.5F, 0.25F})};
      scene.stop_transmittance = 0;
      const auto light = truth::integrate(scene);
      for (const scene::Method method : {scene::Method::kernel, scene::Method::slab}) {
        scene.method = method;
        const engine::Image image = render(scene).image;
        for (std::size_t i = 0; i < light.size(); ++i) {
          if (!(light[i].rgb[0] > 1e-3 * static_cast<double>(rho))) continue;
          for (std::size_t c = 0; c < 3; ++c) {
            // Partial footprints at the near plane are interpolated.
            EXPECT_NEAR(image.rgba[4 * i + c] / light[i].rgb[c], 1, distance > 0 ? 1e-4 : 5e-3)
                << rho << " method " << static_cast<int>(method);
          }
          EXPECT_NEAR(image.rgba[4 * i + 3], light[i].alpha, distance > 0 ? 2e-6 : 1e-3) << rho;
        }
      }
    }
  }
}

TEST(Media, ExtinctionsAddAndWeightTheirColors) {
  scene::Scene scene = one_splat(0.6, {1, 1, 1}, {0, 1, 0}, false);
  scene.scalars.push_back(medium(uniform(scene.lattice, 1.8F), {0.0F, 0.1F, 1.0F}));
  const engine::Image image = render(scene).image;
  const double alpha = -std::expm1(-2.4 / footprint_integral);
  EXPECT_NEAR(pixel(image, 31, 31)[3], alpha, 1e-6);
  EXPECT_NEAR(pixel(image, 31, 31)[0], alpha * 0.25, 1e-6);
  EXPECT_NEAR(pixel(image, 31, 31)[1], alpha * (0.25 * 0.5 + 0.75 * 0.1), 1e-6);
  EXPECT_NEAR(pixel(image, 31, 31)[2], alpha * (0.25 * 0.25 + 0.75), 1e-6);
}

TEST(Media, ExtinctionIsDiscontinuousWhereItsPointsCoincide) {
  scene::Scene scene = one_splat(1, {1, 1, 1}, {0, 1, 0}, false);
  const auto alpha_at = [&](float value) {
    scene.scalars[0].field = uniform(scene.lattice, value);
    return static_cast<double>(pixel(render(scene).image, 31, 31)[3]);
  };
  scene.scalars[0].extinction = {{-1, 1}, {0.5, 1}, {0.5, 3}, {2, 6}};
  const auto expected = [](double rho) { return -std::expm1(-rho / footprint_integral); };
  EXPECT_NEAR(alpha_at(-5.0F), expected(1), 1e-6);
  EXPECT_NEAR(alpha_at(0.499999F), expected(1), 1e-5);
  EXPECT_NEAR(alpha_at(0.5F), expected(3), 1e-5);
  EXPECT_NEAR(alpha_at(1.25F), expected(4.5), 1e-6);
  EXPECT_NEAR(alpha_at(9.0F), expected(6), 1e-6);
}

}  // namespace
}  // namespace windsplat::test
