// The kernel of the reference, and its quadrature along one ray, compared with closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "server/engine/reference/kernels.hpp"
#include "server/engine/reference/profile.hpp"
#include "server/engine/reference/ray.hpp"
#include "server/engine/reference/reference.hpp"
#include "tests/numerics/naive_renderer.hpp"
#include "tests/numerics/partial_footprint.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

namespace reference = engine::reference;
using reference::Light;
using reference::Samples;
using reference::Surface;
using Rgb = std::array<double, 3>;

constexpr double s = 0.48;
constexpr double t = 1.37;

TEST(Kernel3d, ItsLineIntegralIsTheFootprint) {
  for (int i = 0; i < 140; ++i) {
    const double r = 0.01 * i;
    EXPECT_NEAR(partial_footprint(r, 9), footprint(r), 1e-9) << r;
    EXPECT_NEAR(partial_footprint(r, 0), 0.5 * footprint(r), 1e-9) << r;
  }
}

TEST(Kernel3d, ConservesMassAndIsNonnegative) {
  const auto shell = [](double r) { return 4 * pi * r * r * reference::kernel_3d(r); };
  EXPECT_NEAR(simpson(shell, 0, s) + simpson(shell, s, t), footprint_integral, 1e-9);
  for (int i = 0; i <= 20000; ++i) EXPECT_GE(reference::kernel_3d(1e-4 * i), 0);
  EXPECT_EQ(reference::kernel_3d(t), 0);
  EXPECT_EQ(reference::kernel_3d(2), 0);
  // Continuous where its two formulas meet.
  EXPECT_NEAR(reference::kernel_3d(s - 1e-9), reference::kernel_3d(s + 1e-9), 1e-8);
}

TEST(Kernel3d, TableErrorIsBelowOneInATrillion) {
  const reference::Profile profile;
  double worst = 0;
  for (int i = 0; i <= 300000; ++i) {
    const double r = 5e-6 * i;
    worst = std::max(worst, std::abs(profile(r * r) - reference::kernel_3d(r)));
  }
  EXPECT_LT(worst, 1e-12);
}

// ---- one ray through a medium given by formulas ----

struct Formula {
  std::function<double(double)> rho;
  std::function<Rgb(double)> color;
  void begin(double, double) const {}
  void operator()(const double* depth, int count, Samples& out) const {
    for (int j = 0; j < count; ++j) {
      out.extinction[j] = rho(depth[j]);
      const Rgb c = color(depth[j]);
      for (int i = 0; i < 3; ++i) out.emission[i][j] = out.extinction[j] * c[i];
    }
  }
};

Formula one_color(std::function<double(double)> rho, const Rgb& color) {
  return {std::move(rho), [=](double) { return color; }};
}

Light along(const Formula& formula, const std::vector<double>& breaks,
            const std::vector<Surface>& sheets = {}, double tolerance = 1e-12) {
  reference::RayCount count;
  Formula medium = formula;
  return reference::integrate_ray(reference::make_rules(), medium, breaks, sheets, tolerance,
                                  count);
}

constexpr Rgb fog{0.9, 0.4, 0.1};

void expect_light(const Light& light, double alpha, const Rgb& rgb, double tolerance = 1e-10) {
  EXPECT_NEAR(light.alpha, alpha, tolerance);
  EXPECT_NEAR(light.transmittance, 1 - alpha, tolerance);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(light.rgb[c], rgb[c], tolerance) << c;
}

Rgb times(const Rgb& c, double f) { return {c[0] * f, c[1] * f, c[2] * f}; }

TEST(Ray, SlabRampAndBlobHaveTheirClosedForms) {
  for (const double rho : {1e-30, 1e-3, 0.7, 5.0, 40.0, 1e4, 1e30}) {
    const double alpha = -std::expm1(-rho * 2);
    const Light slab = along(one_color([=](double) { return rho; }, fog), {1, 3});
    expect_light(slab, alpha, times(fog, alpha));
    if (rho < 1e-3) {
      EXPECT_NEAR(slab.alpha / alpha, 1, 1e-12);
    }
  }
  for (const double rho : {0.3, 6.0, 200.0}) {
    const auto ramp = [=](double z) { return 0.1 + rho * z; };
    const double tau = (0.1 + (0.1 + 2 * rho)) * 2 / 2;
    expect_light(along(one_color(ramp, fog), {0, 2}), -std::expm1(-tau),
                 times(fog, -std::expm1(-tau)));
    const auto blob = [=](double z) { return rho * std::exp(-z * z / 0.08); };
    const double root = std::sqrt(0.08);
    const double mass =
        rho * root * std::sqrt(pi) / 2 * (std::erf(0.9 / root) + std::erf(2 / root));
    expect_light(along(one_color(blob, fog), {-0.9, 2}), -std::expm1(-mass),
                 times(fog, -std::expm1(-mass)));
  }
}

TEST(Ray, LinearColorHasTheClosedFormOfPhi) {
  const Rgb to{0.2, 1.0, 0.0};
  for (const double tau : {1e-6, 0.01, 0.5, 4.0, 30.0, 1e3, 1e6}) {
    const Formula medium{[=](double) { return tau / 2; },
                         [&](double z) {
                           Rgb c{};
                           for (int i = 0; i < 3; ++i) c[i] = fog[i] + (to[i] - fog[i]) * z / 2;
                           return c;
                         }};
    // phi = (1 - e^-tau) / tau; phi - e^-tau by its series where the difference would cancel.
    const double phi = -std::expm1(-tau) / tau;
    const double second = tau < 0.03
                              ? tau * (1.0 / 2 - tau * (1.0 / 3 - tau * (1.0 / 8 - tau / 30)))
                              : phi - std::exp(-tau);
    const double first = -std::expm1(-tau) - second;
    Rgb rgb{};
    for (int c = 0; c < 3; ++c) rgb[c] = fog[c] * first + to[c] * second;
    expect_light(along(medium, {0, 2}), -std::expm1(-tau), rgb, 1e-8 * std::min(1.0, tau) + 1e-11);
  }
}

// I = c_s (1 - P e^-tau) + sum_k prod_{j<k}(1 - a_j) a_k e^(-rho z_k) (c_k - c_s).
TEST(Ray, SheetsInASlabHaveTheirClosedForm) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const double rho : {0.0, 0.05, 1.0, 9.0, 500.0}) {
    for (const int count : {1, 2, 7, 30}) {
      std::vector<Surface> sheets;
      for (int k = 0; k < count; ++k) {
        sheets.push_back({unit(random), unit(random), {unit(random), unit(random), unit(random)}});
      }
      if (count == 7) sheets[3].opacity = 1;
      sheets.push_back({-0.5, 0.3, {1, 1, 0}});  // in front of the slab
      sheets.push_back({1.5, 0.8, {0, 1, 1}});   // and behind it
      std::sort(sheets.begin(), sheets.end(),
                [](const Surface& a, const Surface& b) { return a.depth < b.depth; });
      double open = 1;
      Rgb rgb{};
      for (const Surface& sheet : sheets) {
        const double seen =
            open * sheet.opacity * std::exp(-rho * std::clamp(sheet.depth, 0.0, 1.0));
        for (int c = 0; c < 3; ++c) rgb[c] += seen * (sheet.color[c] - fog[c]);
        open *= 1 - sheet.opacity;
      }
      const double alpha = 1 - open * std::exp(-rho);
      for (int c = 0; c < 3; ++c) rgb[c] += fog[c] * alpha;
      const Formula medium = one_color([=](double) { return rho; }, fog);
      expect_light(along(medium, {0, 1}, sheets), alpha, rgb);
    }
  }
}

TEST(Ray, CheckeredRayIsCompositedPieceByPiece) {
  const auto odd = [](double z) { return static_cast<int>(std::floor(z)) % 2 == 1; };
  const Rgb other{0.1, 0.2, 1.0};
  const Formula medium{[&](double z) { return odd(z) ? 2.0 : 0.5; },
                       [&](double z) { return odd(z) ? other : fog; }};
  double open = 1;
  Rgb rgb{};
  for (int k = 0; k < 8; ++k) {
    const double here = -std::expm1(k % 2 == 1 ? -2.0 : -0.5);
    for (int c = 0; c < 3; ++c) rgb[c] += open * here * (k % 2 == 1 ? other[c] : fog[c]);
    open *= 1 - here;
  }
  expect_light(along(medium, {0, 1, 2, 3, 4, 5, 6, 7, 8}), 1 - open, rgb);
  // Finds discontinuities that are not given as breaks.
  expect_light(along(medium, {0, 8}, {}, 1e-9), 1 - open, rgb, 1e-7);
}

}  // namespace
}  // namespace windsplat::test
