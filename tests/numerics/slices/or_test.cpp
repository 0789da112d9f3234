// Lines combined by `or`: closed forms, the brute-force integral, and all methods compared.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "server/engine/kernels/dispatch.hpp"
#include "server/study/truth/integrator.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/truth/random_scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Method;
using scene::Scene;

// Equal lines along x one behind the other, seen along y.
Scene lines_in_a_row(int count, bool combine_or) {
  Scene scene;
  scene.lattice = even_lattice({1, count, 1}, {1, 0.1, 1});
  scene.vector =
      plain_lines(make_volume(scene.lattice, 3,
                              [](int c, double, double, double) { return c == 0 ? 1.0F : 0.0F; }),
                  {0.9F, 0.5F, 0.2F});
  scene.vector->length = 0.8;
  scene.vector->opacity = 0.6;
  scene.vector->combine_or = combine_or;
  scene.stop_transmittance = 0;
  scene.camera = look({0, 0, 0}, {0, 1, 0}, 3, 64, 48, false, 0.5);
  return scene;
}

TEST(Or, EqualLinesShowAsOne) {
  for (const Method method : {Method::kernel, Method::slab}) {
    Scene one = lines_in_a_row(1, false);
    Scene five = lines_in_a_row(5, true);
    Scene over = lines_in_a_row(5, false);
    one.method = five.method = over.method = method;
    const auto expected = render(one);
    EXPECT_LE(largest_difference(render(five), expected), 1e-6F);
    const float* middle = pixel(expected.image, 32, 24);
    ASSERT_NEAR(middle[3], 0.6, 1e-3);
    EXPECT_NEAR(pixel(render(over).image, 32, 24)[3], 1 - std::pow(0.4, 5), 1e-3);
  }
}

// The colour of each channel is that of the line in which it is brightest.
TEST(Or, ChannelsOfDifferentLinesAreTheirMaxima) {
  Scene scene = lines_in_a_row(2, true);
  scene.vector->color_by = scene::LineColor::scalar;
  scene.vector->color_field = make_volume(
      scene.lattice, 1, [](int, double, double y, double) { return y < 0 ? 0.0F : 1.0F; });
  scene.vector->color = ramp_color(0, 1, {0.8F, 0.1F, 0.3F}, {0.2F, 0.7F, 0.3F});
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    const auto picture = render(scene);
    const float* middle = pixel(picture.image, 32, 24);
    EXPECT_NEAR(middle[0], 0.6 * 0.8, 1e-3);
    EXPECT_NEAR(middle[1], 0.6 * 0.7, 1e-3);
    EXPECT_NEAR(middle[2], 0.6 * 0.3, 1e-3);
    EXPECT_NEAR(middle[3], 0.6, 1e-3);
  }
}

Scene random_or(std::uint32_t seed) {
  Scene scene = random_scene(seed, false);
  if (scene.vector) scene.vector->combine_or = true;
  scene.stop_transmittance = 0;
  return scene;
}

class RandomOr : public testing::TestWithParam<std::uint32_t> {};

TEST_P(RandomOr, ReferenceEqualsTheTruth) {
  const Scene scene = random_or(GetParam());
  EXPECT_LT(truth::largest_error(reference_picture(scene), truth::integrate(scene)), 1e-5);
}

TEST_P(RandomOr, LinesEqualTheTruthOnEveryInstructionSetAndNeverExceedOver) {
  Scene scene = random_or(GetParam());
  if (!scene.vector) return;
  scene.scalars.clear();
  const auto light = truth::integrate(scene);
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    for (const engine::kernels::Table* table : engine::kernels::usable_tables()) {
      const auto picture = render_with(*table, scene);
      EXPECT_LT(truth::largest_error(picture.image.rgba, light), 1e-4) << table->name;
    }
    Scene over = scene;
    over.vector->combine_or = false;
    const auto most = render(over);
    for (std::size_t i = 0; i < light.size(); ++i) {
      ASSERT_LE(light[i].alpha, static_cast<double>(most.image.rgba[4 * i + 3]) + 1e-4);
    }
  }
}

// The lines lie over the medium: I = L + (1 - A_L) M.
TEST_P(RandomOr, LinesLieOverTheMedium) {
  Scene scene = random_or(GetParam());
  if (!scene.vector || scene.scalars.empty()) return;
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    Scene lines = scene;
    lines.scalars.clear();
    Scene medium = scene;
    medium.vector.reset();
    const auto both = render(scene);
    const auto over = render(lines);
    const auto under = render(medium);
    for (std::size_t i = 0; i < both.image.rgba.size(); ++i) {
      const float left = 1 - over.image.rgba[i - i % 4 + 3];
      // Slabs begin at other depths without lines: rounding of optical depths.
      ASSERT_NEAR(both.image.rgba[i], over.image.rgba[i] + left * under.image.rgba[i], 2e-5);
    }
  }
}

// A ball, or a ground, within the box.
scene::Body body_of(std::uint32_t seed) {
  scene::Body body;
  body.color = {0.2F, 0.3F, 0.1F};
  body.radius = 0.3;
  if (seed % 2 == 0) {
    body.shape = scene::BodyShape::ground;
    body.low = {-0.4, -0.3};
    body.high = {0.4, 0.5};
    body.height = -0.05;
  }
  return body;
}

TEST_P(RandomOr, ABodyHidesTheLinesBehindIt) {
  Scene scene = random_or(GetParam());
  if (!scene.vector) return;
  scene.scalars.clear();
  scene.body = body_of(GetParam());
  const std::vector<double> reference = reference_picture(scene);
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    for (const engine::kernels::Table* table : engine::kernels::usable_tables()) {
      const auto picture = render_with(*table, scene);
      double most = 0;
      for (std::size_t i = 0; i < reference.size(); ++i) {
        most = std::max(most, std::abs(static_cast<double>(picture.image.rgba[i]) - reference[i]));
      }
      EXPECT_LT(most, 5e-4) << table->name;  // at the limb
    }
  }
}

// Pixels that a body covers wholly or not at all: their neighbours are covered alike.
std::vector<std::size_t> away_from_edges(const Scene& scene,
                                         const std::vector<truth::Light>& light) {
  const int width = scene.camera.width;
  std::vector<std::size_t> out;
  for (int y = 1; y + 1 < scene.camera.height; ++y) {
    for (int x = 1; x + 1 < width; ++x) {
      const auto at = static_cast<std::size_t>(y * width + x);
      bool alike = true;
      for (int dy = -width; dy <= width; dy += width) {
        for (int dx = -1; dx <= 1; ++dx)
          alike = alike && light[at + dy + dx].body == light[at].body;
      }
      if (alike) out.push_back(at);
    }
  }
  return out;
}

// Without lines or medium if there is nothing to compare. A ground seen on edge is narrower than a
// pixel and covers none wholly.
Scene random_or_before_a_body(std::uint32_t seed) {
  Scene scene = random_or(seed);
  scene.body = body_of(seed);
  scene.camera.width = 30;
  scene.camera.height = 24;
  const bool on_edge = std::abs(scene.camera.forward.z) < 0.2;
  if (scene.body->shape == scene::BodyShape::ground && on_edge) scene.vector.reset();
  return scene;
}

TEST_P(RandomOr, LinesAndAMediumBeforeABodyEqualTheTruth) {
  Scene scene = random_or_before_a_body(GetParam());
  if (!scene.vector || scene.scalars.empty()) return;
  const auto light = truth::integrate(scene);
  const auto pixels = away_from_edges(scene, light);
  const auto most = [&](const auto& rgba) {
    double error = 0;
    for (const std::size_t at : pixels) {
      for (std::size_t c = 0; c < 4; ++c) {
        const double expected = c < 3 ? light[at].rgb[c] : light[at].alpha;
        error = std::max(error, std::abs(static_cast<double>(rgba[4 * at + c]) - expected));
      }
    }
    return error;
  };
  EXPECT_LT(most(reference_picture(scene)), 1e-5);
  scene.method = Method::slab;
  scene.slab_thickness = 0.1;
  for (const engine::kernels::Table* table : engine::kernels::usable_tables()) {
    EXPECT_LT(most(render_with(*table, scene).image.rgba), 2e-3) << table->name;
  }
}

// The lines before the body lie over its medium and the body: I = L + (1 - A) M.
TEST_P(RandomOr, LinesBeforeABodyLieOverItsMedium) {
  Scene scene = random_or_before_a_body(GetParam());
  if (!scene.vector || scene.scalars.empty()) return;
  Scene lines = scene;
  lines.scalars.clear();
  lines.body->color = {};
  const auto before_black = truth::integrate(lines);
  lines.body->color = {1, 1, 1};
  const auto before_white = truth::integrate(lines);
  lines.vector.reset();
  const auto white = truth::integrate(lines);
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    Scene under = scene;
    under.vector.reset();
    const auto both = render(scene);
    const auto below = render(under);
    for (const std::size_t at : away_from_edges(scene, white)) {
      const double left =
          white[at].body ? (before_white[at].rgb[0] - before_black[at].rgb[0]) / white[at].rgb[0]
                         : 1 - before_black[at].alpha;
      for (std::size_t c = 0; c < 3; ++c) {
        const double medium = below.image.rgba[4 * at + c];
        ASSERT_NEAR(both.image.rgba[4 * at + c], before_black[at].rgb[c] + left * medium, 1e-4);
      }
    }
  }
}

TEST_P(RandomOr, ThreadsDoNotMatter) {
  Scene scene = random_or(GetParam());
  for (const Method method : {Method::kernel, Method::slab}) {
    scene.method = method;
    EXPECT_EQ(render(scene, 1).image.rgba, render(scene, 3).image.rgba);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomOr, testing::Range(1U, 17U));

}  // namespace
}  // namespace windsplat::test
