// The opaque body of a scene: closed forms, the reference, and what it hides.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/reference/reference.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Body;
using scene::BodyShape;
using scene::Method;
using scene::Scene;

constexpr float masked = std::numeric_limits<float>::quiet_NaN();

Body sphere(double radius) {
  Body body;
  body.radius = radius;
  body.color = {0.1F, 0.2F, 0.4F};
  return body;
}

Body ground(double height) {
  Body body = sphere(1);
  body.shape = BodyShape::ground;
  body.low = {-0.8, -0.6};
  body.high = {0.7, 0.9};
  body.height = height;
  return body;
}

engine::reference::Picture truth_of(const Scene& scene, double tolerance) {
  ThreadPool pool(2);
  engine::reference::Options options;
  options.tolerance = tolerance;
  auto picture = engine::reference::render(scene, pool, CancelToken(), options);
  if (!picture) throw std::runtime_error(picture.error().message);
  return std::move(*picture);
}

struct Error {
  double most = 0;
  double rms = 0;
};

Error error_of(const engine::Image& image, const engine::reference::Picture& truth) {
  Error error;
  for (std::size_t i = 0; i < truth.rgba.size(); ++i) {
    const double d = static_cast<double>(image.rgba[i]) - truth.rgba[i];
    error.most = std::max(error.most, std::abs(d));
    error.rms += d * d;
  }
  error.rms = std::sqrt(error.rms / static_cast<double>(truth.rgba.size()));
  return error;
}

// Every method draws the same picture of a body alone.
std::vector<std::vector<double>> pictures_of(Scene scene) {
  std::vector<std::vector<double>> all{truth_of(scene, 1e-10).rgba};
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    const engine::Image image = render(scene).image;
    all.emplace_back(image.rgba.begin(), image.rgba.end());
  }
  return all;
}

TEST(Body, ASphereAloneCoversItsDisc) {
  constexpr int size = 90;
  constexpr double radius = 0.7;
  constexpr double distance = 3;
  for (const bool perspective : {true, false}) {
    Scene scene;
    scene.lattice = even_lattice({2, 2, 2}, {1, 1, 1});
    const double half_height = perspective ? 0.3 : 0.9;
    scene.camera =
        look({0, 0, 0}, {0.3, 0.8, -0.4}, distance, size, size, perspective, half_height);
    scene.body = sphere(radius);
    const double pixel = 2 * half_height / size;
    const double limb =
        (perspective ? radius / std::sqrt(distance * distance - radius * radius) : radius) / pixel;
    for (const std::vector<double>& rgba : pictures_of(scene)) {
      double area = 0;
      for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
          const double* const at = rgba.data() + 4 * (static_cast<std::size_t>(y) * size + x);
          const double off = std::hypot(x + 0.5 - size / 2.0, y + 0.5 - size / 2.0);
          area += at[3];
          if (off > limb + 1) {
            EXPECT_EQ(at[3], 0);
            EXPECT_EQ(at[2], 0);
          }
          if (off >= limb - 1) continue;
          EXPECT_EQ(at[3], 1);
          if (perspective) continue;
          const double shade = 0.6 + 0.4 * std::sqrt(1 - off * off / (limb * limb));
          for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(at[c], shade * static_cast<double>(scene.body->color[c]), 1e-6);
          }
        }
      }
      EXPECT_NEAR(area, pi * limb * limb, 1e-3 * area);
    }
  }
}

// In the middle of a picture from above: an edge between pixels, and one through a quarter of them.
TEST(Body, ARectangleCoversItsArea) {
  for (const bool perspective : {true, false}) {
    Scene scene;
    scene.lattice = even_lattice({2, 2, 2}, {1, 1, 1});
    scene.camera = look({0, 0, 0}, {0, 0, -1}, 2, 80, 80, perspective, perspective ? 0.5 : 1);
    scene.body = ground(0);
    scene.body->low = {-0.5, -0.4};
    scene.body->high = {0.25 + 0.25 * 0.025, 0.4};
    for (const std::vector<double>& rgba : pictures_of(scene)) {
      double area = 0;
      for (std::size_t i = 3; i < rgba.size(); i += 4) area += rgba[i];
      EXPECT_NEAR(area, (0.75 + 0.25 * 0.025) * 0.8 / (0.025 * 0.025), 1e-3);
      const double* const middle = rgba.data() + 4 * (40 * 80 + 40);
      EXPECT_NEAR(middle[2], static_cast<double>(scene.body->color[2]), 1e-4);
      EXPECT_NEAR(middle[3], 1, 1e-6);
    }
  }
}

// C = c_s (1 - exp(-tau)) + exp(-tau) c_b with tau up to the body; footprints ripple by 1 %.
TEST(Body, AHomogeneousMediumBeforeItAbsorbsUpToIt) {
  using scene::Compositing;
  constexpr double rho = 1.5;
  for (const Body& body : {ground(0.13), ground(-0.31), sphere(0.52)}) {
    for (const Compositing compositing :
         {Compositing::simple, Compositing::cd_naive, Compositing::cd, Compositing::analytic}) {
      for (const Method method : {Method::kernel, Method::slab}) {
        Scene scene;
        scene.lattice = even_lattice({12, 12, 40}, {0.1, 0.1, 0.05});
        scene.camera = look({0, 0, 0}, {0, 0, -1}, 4, 9, 9, false, 0.05);
        scene.scalars = {
            medium(uniform(scene.lattice, static_cast<float>(rho)), {0.9F, 0.5F, 0.2F})};
        scene.body = body;
        scene.compositing = compositing;
        scene.method = method;
        scene.stop_transmittance = 0;
        const double hit = body.shape == BodyShape::ground ? body.height : body.radius;
        const double passed = std::exp(-rho * (1 - hit));
        const engine::Rendered rendered = render(scene);
        const float* const at = pixel(rendered.image, 4, 4);
        const std::array<double, 3> color{0.9, 0.5, 0.2};
        for (int c = 0; c < 3; ++c) {
          const double expected =
              color[c] * (1 - passed) + passed * static_cast<double>(body.color[c]);
          EXPECT_NEAR(at[c], expected, 0.01 * passed * rho * (1 - hit));
        }
        EXPECT_EQ(at[3], 1);
      }
    }
  }
}

// A layer of medium on the ground, much thinner than a slab: its part before the ground counts
// wherever the ground lies within the slab.
TEST(Body, AThinLayerOnTheGroundDoesNotDependOnTheSlabs) {
  for (const bool perspective : {true, false}) {
    Scene scene;
    scene.lattice = even_lattice({20, 20, 40}, {0.1, 0.1, 0.05});
    scene.camera =
        look({0, 0, 0}, {0.5, 0.3, -0.8}, 4, 60, 50, perspective, perspective ? 0.1 : 0.4);
    const auto layer = make_volume(scene.lattice, 1, [](int, double, double, double z) {
      return z > 0 && z < 0.1 ? 10.0F : masked;
    });
    scene.scalars = {medium(layer, {0.9F, 0.9F, 0.9F})};
    scene.body = ground(0);
    scene.body->low = {-2, -2};
    scene.body->high = {2, 2};
    scene.method = Method::slab;
    scene.stop_transmittance = 0;
    const engine::reference::Picture truth = truth_of(scene, 1e-7);
    for (const double thickness : {0.5, 2.0, 8.0, 8.7}) {
      scene.slab_thickness = thickness;
      EXPECT_LT(error_of(render(scene).image, truth).most, 2e-3) << thickness;
    }
  }
}

// Lines in the layers above or below z = 0, seen from above; the others are masked.
Scene layered_lines(bool above, bool below, bool perspective) {
  Scene scene;
  scene.lattice = even_lattice({12, 10, 6}, {0.1, 0.1, 0.2});
  scene.camera = look({0, 0, 0}, {0.2, 0.1, -1}, 3, 70, 60, perspective, perspective ? 0.3 : 0.9);
  scene.vector = plain_lines(make_volume(scene.lattice, 3,
                                         [=](int c, double x, double y, double z) {
                                           if (!(z > 0 ? above : below)) return masked;
                                           const double angle = 3 * x + 2 * y + 5 * z;
                                           return static_cast<float>(c == 0   ? std::sin(angle)
                                                                     : c == 1 ? std::cos(angle)
                                                                              : 0.0);
                                         }),
                             {1, 0.8F, 0.2F});
  scene.vector->length = 0.15;
  scene.vector->opacity = 0.7;
  scene.body = ground(0);
  scene.body->low = {-2, -2};
  scene.body->high = {2, 2};
  scene.stop_transmittance = 0;
  return scene;
}

TEST(Body, LinesBehindItAddNothingAndLinesBeforeItAreUnchanged) {
  for (const Method method : {Method::kernel, Method::slab}) {
    for (const bool perspective : {true, false}) {
      const auto draw = [&](bool above, bool below, bool body) {
        Scene scene = layered_lines(above, below, perspective);
        scene.method = method;
        if (!body) scene.body.reset();
        return render(scene);
      };
      const engine::Rendered alone = draw(false, false, true);
      EXPECT_EQ(largest_difference(draw(false, true, true), alone), 0);
      const engine::Rendered lines = draw(true, false, false);
      const engine::Rendered over = draw(true, false, true);
      EXPECT_LE(largest_difference(draw(true, true, true), over), 1e-6);
      float brightest = 0;
      for (std::size_t i = 0; i < over.image.rgba.size(); ++i) {
        const float left = 1 - lines.image.rgba[i / 4 * 4 + 3];
        EXPECT_NEAR(over.image.rgba[i], lines.image.rgba[i] + left * alone.image.rgba[i], 2e-6);
        brightest = std::max(brightest, lines.image.rgba[i]);
      }
      EXPECT_GT(brightest, 0.5F);
    }
  }
}

// A shell around the origin, without caps about the poles: `step` degrees between columns.
Scene globe(bool perspective, bool with_medium, double step = 10) {
  Scene scene;
  const int columns = static_cast<int>(360 / step);
  const int rows = 2 * static_cast<int>(80 / step) + 1;
  const double cell = step / 200;
  scene.lattice = even_lattice({columns, rows, 4}, {cell, cell, cell});
  auto places = std::make_shared<std::vector<std::array<float, 3>>>();
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        const double r = 0.9 + 0.025 * (k + 0.5);
        const double latitude = (j - rows / 2) * step * pi / 180;
        const double longitude = i * step * pi / 180;
        places->push_back({static_cast<float>(r * std::cos(latitude) * std::sin(longitude)),
                           static_cast<float>(-r * std::cos(latitude) * std::cos(longitude)),
                           static_cast<float>(r * std::sin(latitude))});
      }
    }
  }
  scene.lattice.places = places;
  scene.lattice.box_min = glm::dvec3(-1);
  scene.lattice.box_max = glm::dvec3(1);
  scene.camera =
      look({0, 0, 0}, {0.4, 0.8, -0.5}, 3, 130, 120, perspective, perspective ? 0.37 : 1.05);
  scene.vector = plain_lines(
      make_volume(scene.lattice, 3,
                  [](int c, double x, double y, double z) {
                    return static_cast<float>(c == 0 ? 1 + std::sin(9 * y) : std::sin(4 * x + z));
                  }),
      {1, 1, 0.2F});
  scene.vector->length = 0.1;
  scene.vector->opacity = 0.9;
  scene.body = sphere(0.9);
  scene.method = Method::slab;
  scene.stop_transmittance = 0;
  if (!with_medium) return scene;
  const auto cloud = make_volume(scene.lattice, 1, [](int, double x, double y, double) {
    return static_cast<float>(2 + 2 * std::sin(5 * x) * std::cos(4 * y));
  });
  scene.scalars = {medium(cloud, {0.3F, 0.6F, 1.0F})};
  return scene;
}

// Lines alone are exact in slabs, also in pixels that the body covers in part.
TEST(Body, LinesOnAGlobeEqualTheReference) {
  for (const bool perspective : {true, false}) {
    Scene scene = globe(perspective, false);
    const engine::reference::Picture truth = truth_of(scene, 1e-9);
    for (const engine::kernels::Table* table : engine::kernels::usable_tables()) {
      for (const double thickness : {0.5, 4.0}) {
        scene.slab_thickness = thickness;
        EXPECT_LT(error_of(render_with(*table, scene).image, truth).most, 2e-4) << table->name;
      }
    }
    scene.method = Method::kernel;
    EXPECT_LT(error_of(render(scene).image, truth).rms, 0.02);
  }
}

TEST(Body, ThinnerSlabsOfAGlobeApproachTheReference) {
  Scene scene = globe(true, true);
  const engine::reference::Picture truth = truth_of(scene, 1e-7);
  double last = 1;
  for (const double thickness : {2.0, 1.0, 0.5, 0.25}) {
    scene.slab_thickness = thickness;
    const double error = error_of(render(scene).image, truth).rms;
    EXPECT_LT(error, 0.7 * last) << thickness;
    last = error;
  }
  EXPECT_LT(last, 1e-3);
}

TEST(Body, InstructionSetsAgree) {
  for (const Method method : {Method::kernel, Method::slab}) {
    Scene scene = globe(true, true);
    scene.method = method;
    const auto tables = engine::kernels::usable_tables();
    const engine::Rendered portable = render_with(*tables.front(), scene);
    for (const engine::kernels::Table* table : tables) {
      EXPECT_LE(largest_difference(render_with(*table, scene), portable), 2e-5) << table->name;
    }
  }
}

TEST(Body, AnyNumberOfThreadsGivesTheSameBits) {
  for (const Method method : {Method::kernel, Method::slab}) {
    Scene scene = globe(true, true);
    scene.method = method;
    const engine::Rendered one = render(scene, 1);
    const engine::Rendered many = render(scene, 5);
    EXPECT_EQ(one.image.rgba, many.image.rgba);
    EXPECT_EQ(one.work.occluded, many.work.occluded);
    EXPECT_EQ(one.work.tiles, many.work.tiles);
  }
}

// The part of a sphere that an eye at distance d does not see is (1 + r / d) / 2.
TEST(Body, TheFarSideOfAGlobeIsLeftOut) {
  for (const Method method : {Method::kernel, Method::slab}) {
    for (const bool perspective : {true, false}) {
      Scene scene = globe(perspective, true, 2.5);
      scene.method = method;
      const engine::WorkReport with = render(scene).work;
      scene.body.reset();
      const engine::WorkReport without = render(scene).work;
      EXPECT_EQ(with.samples, without.samples);
      EXPECT_EQ(without.culled, 0);
      const double hidden = static_cast<double>(with.culled) / static_cast<double>(with.samples);
      // Kernels reach 0.13 beyond their positions, up to the limb or before it.
      EXPECT_GT(hidden, perspective ? 0.25 : 0.12);
      EXPECT_LT(hidden, perspective ? 0.5 * (1 + 0.9 / 3) : 0.5);
      EXPECT_LT(static_cast<double>(with.pixel_updates),
                0.75 * static_cast<double>(without.pixel_updates));
    }
  }
}

// A rectangle below the eye, whose edges are in sight.
Scene above_ground(const Scene& from, const glm::dvec3& eye, const glm::dvec3& forward,
                   double height) {
  Scene scene = from;
  scene.vector->length = 0.5;
  scene.vector->r1 = 1;
  scene.vector->r2 = 2.5;
  scene.camera = look(eye, forward, 0, 40, 30, true, 0.8);
  scene.camera.near = 0.01;
  scene.body = ground(height);
  scene.body->low = {-0.3, -0.3};
  scene.body->high = {0.3, 0.4};
  scene.stop_transmittance = 0;
  return scene;
}

// One splat around the eye, which the near plane, a line and the ground divide. Either method is
// exact up to the interpolation of partial footprints and the thickness of slabs.
TEST(Body, ASplatAroundTheEyeEndsAtTheGround) {
  Scene one;
  one.lattice = even_lattice({1, 1, 1}, {0.5, 0.5, 0.5});
  one.scalars = {medium(uniform(one.lattice, 2.0F), {0.2F, 0.9F, 0.5F})};
  one.vector = plain_lines(make_volume(one.lattice, 3,
                                       [](int c, double, double, double) {
                                         return c == 0 ? 1.0F : c == 1 ? 0.0F : 0.6F;
                                       }),
                           {1.0F, 0.5F, 0.1F});
  for (const glm::dvec3& forward : {glm::dvec3{0, -0.9, -0.45}, {0.3, -0.6, -0.7}}) {
    for (const double height : {-0.12, -0.02}) {
      Scene scene = above_ground(one, {0, 0.2, 0.1}, forward, height);
      const engine::reference::Picture truth = truth_of(scene, 1e-9);
      EXPECT_NEAR(truth.rgba[4 * (29 * 40 + 20) + 3], 1, 1e-9) << "the ground is below";
      scene.method = Method::kernel;
      for (const engine::kernels::Table* table : engine::kernels::usable_tables()) {
        EXPECT_LT(error_of(render_with(*table, scene).image, truth).most, 3e-3) << table->name;
      }
      scene.method = Method::slab;
      scene.slab_thickness = 0.05;
      EXPECT_LT(error_of(render(scene).image, truth).most, 3e-3) << height;
    }
  }
}

// The same among many: between neighbours method kernel is an approximation.
TEST(Body, AnEyeInAMediumNearTheGroundSeesTheReference) {
  Scene many;
  many.lattice = even_lattice({6, 6, 5}, {0.15, 0.15, 0.12});
  many.scalars = {medium(make_volume(many.lattice, 1,
                                     [](int, double x, double y, double) {
                                       return static_cast<float>(2 + std::sin(6 * x + 4 * y));
                                     }),
                         {0.2F, 0.9F, 0.5F})};
  many.vector =
      plain_lines(make_volume(many.lattice, 3,
                              [](int c, double x, double y, double z) {
                                return static_cast<float>(std::sin(7 * x + 5 * y + 3 * z + 2 * c));
                              }),
                  {1.0F, 0.5F, 0.1F});
  for (const double height : {-0.08, 0.03}) {
    Scene scene = above_ground(many, {0.03, 0.2, 0.1}, {0.2, -0.9, -0.45}, height);
    scene.vector->length = 0.2;
    const engine::reference::Picture truth = truth_of(scene, 1e-8);
    scene.method = Method::slab;
    scene.slab_thickness = 0.1;
    EXPECT_LT(error_of(render(scene).image, truth).rms, 2e-3) << height;
    scene.method = Method::kernel;
    EXPECT_LT(error_of(render(scene).image, truth).rms, 0.03) << height;
  }
}

TEST(Body, AnEyeWithinASphereDoesNotSeeIt) {
  Scene scene = globe(true, true);
  scene.camera = look({0, 0, 0}, {1, 0.2, 0.1}, 0, 60, 50, true, 0.8);
  const engine::Rendered with = render(scene);
  scene.body.reset();
  EXPECT_EQ(with.image.rgba, render(scene).image.rgba);
}

}  // namespace
}  // namespace windsplat::test
