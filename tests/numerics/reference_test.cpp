// The reference against closed forms: its kernel, its quadrature along one ray, and whole pictures.
#include "server/engine/reference/reference.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>

#include "server/engine/reference/kernels.hpp"
#include "server/engine/reference/profile.hpp"
#include "server/engine/reference/ray.hpp"
#include "tests/numerics/naive_renderer.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

namespace reference = engine::reference;
using reference::Light;
using reference::Samples;
using reference::Sheet;
using Rgb = std::array<double, 3>;

constexpr double s = 0.48;
constexpr double t = 1.37;

// Simpson's rule with nodes graded towards both ends: independent of the tested rule.
double simpson(const std::function<double(double)>& f, double from, double to) {
  constexpr int steps = 4000;
  double sum = 0;
  for (int i = 0; i <= steps; ++i) {
    const double w = static_cast<double>(i) / steps;
    const double weight = i == 0 || i == steps ? 1 : (i % 2 == 1 ? 4 : 2);
    sum += weight * f(from + (to - from) * w * w * (3 - 2 * w)) * 6 * w * (1 - w);
  }
  return sum * (to - from) / (3 * steps);
}

// The integral of K from infinity to z (in cells from the centre) along a line at distance b.
double partial_footprint(double b, double z) {
  if (b >= t) return 0;
  const double end = std::sqrt(t * t - b * b);
  const double inner = b < s ? std::sqrt(s * s - b * b) : 0;
  double sum = 0;
  double from = -end;
  for (const double to : {-inner, inner, end}) {
    const double until = std::min(to, z);
    if (until > from) {
      sum += simpson([&](double u) { return reference::kernel_3d(std::hypot(b, u)); }, from, until);
    }
    from = to;
  }
  return sum;
}

reference::Picture truth(const scene::Scene& scene, double tolerance = 1e-10,
                         unsigned threads = 1) {
  ThreadPool pool(threads);
  auto picture = reference::render(scene, pool, CancelToken(), {tolerance});
  if (!picture) throw std::runtime_error(picture.error().message);
  return std::move(*picture);
}

const double* reference_pixel(const reference::Picture& picture, int x, int y) {
  return picture.rgba.data() + 4 * (static_cast<std::size_t>(y) * picture.width + x);
}

std::shared_ptr<const data::Volume> constant_scalar(const scene::Lattice& lattice, double value) {
  return make_volume(lattice, 1,
                     [=](int, double, double, double) { return static_cast<float>(value); });
}

// ---- the kernel ----

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
  // Continuous at the joint of its two formulas.
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
            const std::vector<Sheet>& sheets = {}, double tolerance = 1e-12) {
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
    // phi = (1 - e^-tau) / tau, and phi - e^-tau by its series where that would cancel.
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
      std::vector<Sheet> sheets;
      for (int k = 0; k < count; ++k) {
        sheets.push_back({unit(random), unit(random), {unit(random), unit(random), unit(random)}});
      }
      if (count == 7) sheets[3].opacity = 1;
      sheets.push_back({-0.5, 0.3, {1, 1, 0}});  // in front of and behind the slab
      sheets.push_back({1.5, 0.8, {0, 1, 1}});   // and behind
      std::sort(sheets.begin(), sheets.end(),
                [](const Sheet& a, const Sheet& b) { return a.depth < b.depth; });
      double open = 1;
      Rgb rgb{};
      for (const Sheet& sheet : sheets) {
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
  // Finds discontinuities that are not given.
  expect_light(along(medium, {0, 8}, {}, 1e-9), 1 - open, rgb, 1e-7);
}

// ---- pictures ----

struct Cut {
  double r = 0;      // the ray's distance from the splat's middle, cells
  double cells = 0;  // per world unit along the ray
};

Cut cut_splat(const scene::Camera& camera, const glm::dvec3& centre, const glm::dvec3& cell, int x,
              int y) {
  const double size = 2 * camera.half_height / camera.height;
  const double right = (x + 0.5 - 0.5 * camera.width) * size;
  const double up = (0.5 * camera.height - (y + 0.5)) * size;
  glm::dvec3 ray = camera.forward;
  glm::dvec3 from = camera.eye;
  (camera.perspective ? ray : from) += right * camera.right + up * camera.up;
  ray = glm::normalize(ray);
  const glm::dvec3 d = ray / cell;
  const glm::dvec3 o = (centre - from) / cell;
  return {glm::length(glm::cross(o, d)) / glm::length(d), glm::length(d)};
}

TEST(Reference, OneSplatIsItsFootprintInAnisotropicCells) {
  scene::Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, {0.4, 0.7, 0.25});
  const glm::dvec3 cell{0.4, 0.7, 0.25};
  for (const double rho : {1e-30, 0.02, 3.0, 400.0}) {
    scene.scalars = {medium(constant_scalar(scene.lattice, rho), {1.0F, 0.5F, 0.25F})};
    const auto value = static_cast<double>(static_cast<float>(rho));
    for (const bool perspective : {false, true}) {
      scene.camera =
          look({0.1, 0.2, -0.1}, {0.4, 1, -0.6}, 4, 63, 51, perspective, perspective ? 0.3 : 1.2);
      const reference::Picture picture = truth(scene);
      for (int y = 0; y < 51; ++y) {
        for (int x = 0; x < 63; ++x) {
          const Cut cut = cut_splat(scene.camera, {0, 0, 0}, cell, x, y);
          const double tau = value * footprint(cut.r) / (footprint_integral * cut.cells);
          const double alpha = -std::expm1(-tau);
          ASSERT_NEAR(reference_pixel(picture, x, y)[3], alpha, std::min(1e-9, 0.05 * value))
              << x << " " << y;
          ASSERT_NEAR(reference_pixel(picture, x, y)[1], 0.5 * alpha, std::min(1e-9, 0.05 * value));
        }
      }
    }
  }
}

TEST(Reference, SplatsApartAreCompositedByOver) {
  scene::Scene scene;
  scene.lattice = even_lattice({1, 2, 1}, {1, 3, 1});  // their centres are 3 apart, 1.37 * 3 wide
  scene.lattice.positions[1] = {-5, 5};
  const auto red = make_volume(scene.lattice, 1,
                               [](int, double, double y, double) { return y < 0 ? 1.0F : 0.0F; });
  const auto blue = make_volume(scene.lattice, 1,
                                [](int, double, double y, double) { return y < 0 ? 0.0F : 2.0F; });
  scene.scalars = {medium(red, {1.0F, 0.0F, 0.5F}), medium(blue, {0.0F, 0.25F, 1.0F})};
  for (const double side : {1.0, -1.0}) {
    scene.camera = look({0, 0, 0}, {0, side, 0}, 20, 21, 21, false, 1);
    const reference::Picture picture = truth(scene);
    for (int x = 0; x < 21; ++x) {
      const double g = footprint(std::abs(x - 10) * 2.0 / 21);
      const double first = -std::expm1(-(side > 0 ? 1 : 2) * g * 3 / footprint_integral);
      const double second = -std::expm1(-(side > 0 ? 2 : 1) * g * 3 / footprint_integral);
      const double red_part = side > 0 ? first : second * (1 - first);
      const double blue_part = side > 0 ? second * (1 - first) : first;
      EXPECT_NEAR(reference_pixel(picture, x, 10)[0], red_part, 1e-9) << x;
      EXPECT_NEAR(reference_pixel(picture, x, 10)[2], 0.5 * red_part + blue_part, 1e-9) << x;
      EXPECT_NEAR(reference_pixel(picture, x, 10)[3], red_part + blue_part, 1e-9) << x;
    }
  }
}

// A line through a splat: I = c_s A + a exp(-tf) (c_v - c_s), tf the part of tau in front of it, by
// the partial integral of the kernel.
TEST(Reference, LineInASplatSeesThePartOfTheSplatInFront) {
  for (const double rho : {0.01, 0.7, 3.0, 60.0}) {
    for (const float slope : {0.0F, 4.0F, -9.0F, 30.0F}) {
      scene::Scene scene;
      scene.lattice = even_lattice({1, 1, 1}, {2, 2, 2});
      scene.camera = look({0, 0, 0}, {0, 1, 0}, 5, 81, 3, false, 3.0 / 40);
      const auto wind = make_volume(scene.lattice, 3, [=](int c, double, double, double) {
        return c == 0 ? 10.0F : (c == 1 ? slope : 0.0F);
      });
      scene.vector = plain_lines(wind, {0.2F, 0.5F, 0.8F});
      scene.vector->magnitude_range = {0, 10};
      scene.vector->length = 3;
      scene.vector->r1 = 2;
      scene.vector->r2 = 3;
      scene.vector->opacity = 0.75;
      scene.scalars = {medium(constant_scalar(scene.lattice, rho), {0.9F, 0.1F, 0.3F})};
      const reference::Picture picture = truth(scene);
      const double per_x = static_cast<double>(slope) / 10;  // the line's depth per width
      const double m = std::hypot(1.0, per_x);
      for (int x = 0; x < 81; ++x) {
        const double world = (x - 40) / 20.0;
        if (std::abs(world) > 1.4 / m) continue;  // its rounded ends
        const double r = std::abs(world) / 2;
        const auto value = static_cast<double>(static_cast<float>(rho));
        const double tau = value * footprint(r) * 2 / footprint_integral;
        const double tf = value * partial_footprint(r, world * per_x / 2) * 2 / footprint_integral;
        const double a = 0.75;
        const double alpha = -std::expm1(-tau) + a * std::exp(-tau);
        ASSERT_NEAR(reference_pixel(picture, x, 1)[3], alpha, 1e-9);
        for (int c = 0; c < 3; ++c) {
          const auto line = static_cast<double>(scene.vector->color.entries[0][c]);
          const auto cloud = static_cast<double>(scene.scalars[0].color.entries[0][c]);
          ASSERT_NEAR(reference_pixel(picture, x, 1)[c],
                      cloud * alpha + a * std::exp(-tf) * (line - cloud), 1e-8)
              << rho << " " << slope << " " << x;
        }
      }
    }
  }
}

TEST(Reference, RaysStartAtTheNearPlane) {
  scene::Scene scene;
  scene.lattice = even_lattice({1, 1, 1}, {1, 1, 1});
  scene.scalars = {medium(constant_scalar(scene.lattice, 2), {1.0F, 1.0F, 1.0F})};
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 0.5, 1, 1, true, 0.1);
  for (const double near : {1e-3, 0.2, 0.45}) {
    scene.camera.near = near;  // the centre of the splat is 0.5 away
    const double tau = 2 * (footprint(0) - partial_footprint(0, near - 0.5)) / footprint_integral;
    EXPECT_NEAR(truth(scene).rgba[3], -std::expm1(-tau), 1e-9) << near;
  }
  scene.camera.near = 0.51;
  EXPECT_EQ(truth(scene).rgba[3], 0);
}

TEST(Reference, UniformLatticeAbsorbsWithinTheFootprintsRipple) {
  scene::Scene scene;
  scene.lattice = even_lattice({24, 24, 9}, {1, 1, 1});
  scene.scalars = {medium(constant_scalar(scene.lattice, 0.1), {1.0F, 1.0F, 1.0F})};
  for (const auto& [forward, ripple] :
       {std::pair{glm::dvec3(0, 0, -1), 0.0075}, {glm::dvec3(0.31, 0.17, -1), 0.01}}) {
    scene.camera = look({0, 0, 0}, forward, 100, 24, 24, false, 2);
    const reference::Picture picture = truth(scene);
    const double tau = 0.1 * 9 / std::abs(scene.camera.forward.z);
    double mean = 0;
    for (int i = 0; i < 24 * 24; ++i) {
      const double seen = -std::log1p(-picture.rgba[4 * i + 3]) / tau;
      EXPECT_NEAR(seen, 1, ripple);
      mean += seen / (24 * 24);
    }
    EXPECT_NEAR(mean, 1, 0.002);
  }
}

// Lines alone, whose order is unambiguous, and a medium of one colour, whose optical depths add in
// any order, equal the naive renderer.
TEST(Reference, EqualsTheNaiveRendererWhereThatIsExact) {
  scene::Scene scene;
  scene.lattice = make_lattice({{{0.1, 0.12, 0.09, 0.1, 0.3}, {0.1, 0.1, 0.12, 0.1}, {0.2, 0.15}}});
  const auto wave = [](int c, double x, double y, double z) {
    return static_cast<float>(std::sin(5 * x + c) + std::cos(4 * y - c) * std::sin(3 * z + 1));
  };
  const auto cloud = make_volume(scene.lattice, 1, wave);
  for (const int stride : {1, 2}) {
    for (const bool perspective : {false, true}) {
      scene.camera = look({0, 0, 0}, {0.3, 1, -0.5}, 2, 60, 50, perspective, 0.3);
      scene.vector.reset();
      scene.scalars = {medium(cloud, {0.5F, 0.6F, 0.9F}), medium(cloud, {0.5F, 0.6F, 0.9F})};
      scene.scalars[1].stride = stride;
      const auto mixed = naive::render<double>(scene);
      const reference::Picture picture = truth(scene);
      for (std::size_t i = 0; i < mixed.rgba.size(); ++i) {
        ASSERT_NEAR(picture.rgba[i], mixed.rgba[i], 1e-9);
      }
      scene.scalars.clear();
      scene.vector = plain_lines(make_volume(scene.lattice, 3, wave), {0.9F, 0.5F, 0.1F});
      scene.vector->length = 0.08;
      scene.vector->stride = stride;
      scene.vector->head_desaturation = 0.5;
      scene.vector->jitter_center = 0.5;
      scene.vector->jitter_stride = 0.3;
      scene.vector->r1 = 0.2;
      scene.vector->r2 = 0.4;
      const auto drawn = naive::render<double>(scene);
      const reference::Picture lines = truth(scene);
      double brightest = 0;
      double alpha = 0;
      for (std::size_t i = 0; i < drawn.rgba.size(); ++i) {
        // Where lines of neighbouring cells cross, only opacity is independent of their order.
        if (i % 4 == 3) alpha = std::max(alpha, std::abs(lines.rgba[i] - drawn.rgba[i]));
        brightest = std::max(brightest, drawn.rgba[i]);
      }
      EXPECT_LT(alpha, 1e-12);
      EXPECT_GT(brightest, 0.1);
    }
  }
}

// A rotated lattice seen by an eye rotated with it.
TEST(Reference, RotatedPositionsAndEyeGiveTheSamePicture) {
  scene::Scene scene = cloudy_scene(4, 24);
  scene.lattice = even_lattice({4, 3, 1}, {0.3, 0.4, 0.5});
  const auto wave = [](int c, double x, double y, double) {
    return static_cast<float>(1 + std::sin(5 * x + c) * std::cos(4 * y - c));
  };
  scene.vector->field = make_volume(scene.lattice, 3, wave);
  scene.vector->span = 1.5;
  scene.vector->jitter_stride = 0.3;
  scene.scalars[0].field = make_volume(scene.lattice, 1, wave);
  for (const bool perspective : {false, true}) {
    scene.lattice.places.reset();
    scene.camera = look({0, 0, 0}, {0.3, 1, -0.5}, 3, 24, 24, perspective, perspective ? 0.3 : 0.8);
    const reference::Picture straight = truth(scene);
    const auto turn = [](const glm::dvec3& v) {
      return glm::dvec3(0.8 * v.x - 0.6 * v.y, 0.6 * v.x + 0.8 * v.y, v.z);
    };
    std::vector<std::array<float, 3>> places;
    for (const double y : scene.lattice.positions[1]) {
      for (const double x : scene.lattice.positions[0]) {
        const glm::dvec3 p = turn({x, y, scene.lattice.positions[2][0]});
        places.push_back(
            {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
      }
    }
    scene.lattice.places =
        std::make_shared<const std::vector<std::array<float, 3>>>(std::move(places));
    scene.camera.eye = turn(scene.camera.eye);
    scene.camera.right = turn(scene.camera.right);
    scene.camera.up = turn(scene.camera.up);
    scene.camera.forward = turn(scene.camera.forward);
    const reference::Picture turned = truth(scene);
    for (std::size_t i = 0; i < straight.rgba.size(); ++i) {
      ASSERT_NEAR(straight.rgba[i], turned.rgba[i], 1e-5);  // positions are floats
    }
    EXPECT_GT(straight.rgba[4 * (12 * 24 + 12) + 3], 0.3);
  }
}

TEST(Reference, SliceRendersTheMediumOfItsLayerOnly) {
  scene::Scene scene = cloudy_scene(5, 24);
  scene.vector.reset();
  scene.slice = scene::Slice{2, 3};
  const reference::Picture slice = truth(scene);
  scene.slice.reset();
  auto masked = std::make_shared<data::Volume>(*scene.scalars[0].field);
  for (std::size_t i = 0; i < masked->values.size(); ++i) {
    if (i / 25 != 3) masked->values[i] = std::numeric_limits<float>::quiet_NaN();
  }
  scene.scalars[0].field = masked;
  const reference::Picture rest = truth(scene);
  double brightest = 0;
  for (std::size_t i = 0; i < slice.rgba.size(); ++i) {
    ASSERT_NEAR(slice.rgba[i], rest.rgba[i], 1e-12);
    brightest = std::max(brightest, slice.rgba[i]);
  }
  EXPECT_GT(brightest, 0.1);
}

TEST(Reference, SliceDropsTheNormalComponentAndKeepsTheRest) {
  scene::Scene scene;
  scene.lattice = even_lattice({2, 2, 3}, {1, 1, 1});
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 5, 10, 10, false, 2);
  scene.vector = plain_lines(make_volume(scene.lattice, 3,
                                         [](int c, double, double, double) {
                                           return c == 0 ? 6.0F : (c == 2 ? 8.0F : 0);
                                         }),
                             {1.0F, 1.0F, 1.0F});
  scene.vector->magnitude_range = {0, 10};
  scene.vector->length = 0.5;
  scene.slice = scene::Slice{2, 1};
  const auto kernels = reference::list_kernels(scene, reference::make_view(scene.camera));
  ASSERT_EQ(kernels.ribbons.size(), 4U);
  for (const reference::Ribbon& line : kernels.ribbons) {
    EXPECT_NEAR(line.b[0] - line.a[0], 0.3, 1e-12);
    EXPECT_NEAR(line.b[1] - line.a[1], 0, 1e-12);
  }
}

TEST(Reference, AnyThreadCountGivesTheSameBits) {
  const scene::Scene scene = cloudy_scene(8, 33);
  const reference::Picture one = truth(scene, 1e-10, 1);
  const reference::Picture three = truth(scene, 1e-10, 3);
  EXPECT_EQ(one.rgba, three.rgba);
  EXPECT_EQ(one.pieces, three.pieces);
  EXPECT_EQ(one.evaluations, three.evaluations);
  EXPECT_GT(one.evaluations, one.pieces);
}

TEST(Reference, ReportsProgressAndStopsWhenCancelled) {
  const scene::Scene scene = cloudy_scene(6, 20);
  ThreadPool pool(2);
  const CancelToken cancel;
  std::atomic<int> rows{0};
  ASSERT_TRUE(reference::render(scene, pool, cancel, {}, [&](int) { ++rows; }));
  EXPECT_EQ(rows, 20);
  const auto cut = reference::render(scene, pool, cancel, {}, [&](int done) {
    if (done == 5) cancel.cancel();
  });
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().kind, ErrorKind::cancelled);
}

TEST(Reference, ErrorFallsWithItsTolerance) {
  const scene::Scene scene = cloudy_scene(10, 24);
  const reference::Picture exact = truth(scene, 1e-14);
  double before = 1;
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
    const reference::Picture picture = truth(scene, tolerance);
    double worst = 0;
    for (std::size_t i = 0; i < exact.rgba.size(); ++i) {
      worst = std::max(worst, std::abs(picture.rgba[i] - exact.rgba[i]));
    }
    RecordProperty("error_at_" + std::to_string(tolerance), std::to_string(worst * 1e12));
    EXPECT_LE(worst, tolerance);
    EXPECT_LE(worst, before);
    before = worst;
  }
}

}  // namespace
}  // namespace windsplat::test
