// The engine compared with the naive renderer, for random views of random scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "server/engine/kernels/dispatch.hpp"
#include "tests/numerics/naive_renderer.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/truth/random_scenes.hpp"

namespace windsplat::test {
namespace {

using scene::Scene;

enum class What { vectors, scalars, both, two_scalars, strides, fine_medium };

class SceneMaker : private Draws {
 public:
  explicit SceneMaker(std::uint32_t seed, const std::array<int, 3>& dims = {0, 0, 0})
      : Draws(seed), wanted_(dims) {}

  Scene make(What what, bool perspective, bool eye_inside) {
    Scene scene;
    std::array<std::vector<double>, 3> spacing;
    const double cell[3] = {between(0.03, 0.08), between(0.03, 0.08), between(0.05, 0.2)};
    int dims[3] = {whole(9, 26), whole(7, 19), whole(3, 12)};
    for (int a = 0; a < 3; ++a) {
      if (wanted_[a] > 0) dims[a] = wanted_[a];
    }
    for (int a = 0; a < 3; ++a) spacing[a] = widths(dims[a], cell[a], 0.6, 1.4);
    scene.lattice = make_lattice(spacing);
    const int width = whole(60, 150);
    const int height = whole(50, 110);
    const glm::dvec3 forward{between(-1, 1), between(-1, 1), between(-1, 1)};
    const glm::dvec3 target{between(-.3, .3), between(-.2, .2), between(-.2, .2)};
    const double distance = eye_inside ? 0.0 : between(1.5, 4.0);
    const double wide = perspective ? (eye_inside ? 1.3 : between(0.25, 0.5)) : between(0.4, 0.9);
    scene.camera = look(target, forward, distance, width, height, perspective, wide);
    scene.camera.near = 0.01;
    scene.depth_cue = {0.4, distance - 0.5, distance + 0.5};
    scene.compositing = static_cast<scene::Compositing>(whole(0, 3));
    if (whole(0, 5) == 0) {
      const int axis = whole(0, 2);
      scene.slice = scene::Slice{axis, dims[axis] / 2};
    }
    if (what != What::scalars && what != What::two_scalars) scene.vector = lines(scene.lattice);
    if (what != What::vectors) scene.scalars.push_back(cloud(scene.lattice));
    if (what == What::two_scalars) scene.scalars.push_back(cloud(scene.lattice));
    if (what == What::strides) scene.scalars[0].stride = scene.vector->stride = 2;
    if (what == What::fine_medium) {
      scene.vector->stride = 3;
      scene.scalars.push_back(cloud(scene.lattice));
      scene.scalars.back().stride = 2;
    }
    return scene;
  }

 private:
  std::shared_ptr<const data::Volume> field(const scene::Lattice& lattice, int components) {
    const double phase = between(0, 6);
    const double k = between(3, 6);
    const float gap = static_cast<float>(between(0.75, 0.9));
    return make_volume(lattice, components, [=](int c, double x, double y, double z) {
      const double a = phase + 2.1 * c;
      if (std::sin(9 * x + a - 2.1 * c) * std::cos(7 * y) > gap) {
        return std::numeric_limits<float>::quiet_NaN();
      }
      return static_cast<float>(std::sin(k * x + a) + std::cos(k * y - a) * std::sin(4 * z + a));
    });
  }

  scene::VectorLayer lines(const scene::Lattice& lattice) {
    scene::VectorLayer layer;
    layer.field = field(lattice, whole(2, 3));
    layer.length = between(0.1, 0.4);
    layer.span = between(2, 7);
    layer.r1 = between(0.2, 1.5);
    layer.r2 = layer.r1 + between(0.8, 1.5);
    layer.scale = {1, between(0.5, 2), between(0.5, 3)};
    layer.color = ramp_color(-0.6, 0.6, {0.1F, 0.3F, 0.9F}, {1.0F, 0.8F, 0.1F});
    layer.color_by = static_cast<scene::LineColor>(whole(0, 6));
    layer.moving = whole(0, 3) == 0;
    layer.motion_cycles = between(-3, 3);
    if (layer.color_by == scene::LineColor::direction) layer.color.range = {0, 360};
    if (layer.color_by == scene::LineColor::scalar) layer.color_field = field(lattice, 1);
    if (layer.color_by == scene::LineColor::screen_z) layer.color.range = {0, 4};
    if (layer.color_by == scene::LineColor::rise) layer.color.range = {-0.3, 0.3};
    layer.magnitude_range = {0.2, 1.8};
    layer.min_magnitude = 0.3;
    layer.seed = static_cast<std::uint32_t>(whole(0, 1 << 30));
    layer.overlap = whole(0, 3) != 0;
    if (whole(0, 1) == 1) {
      for (int j = 0; j < lattice.dims[1]; ++j) layer.rate_x.push_back(between(0.5, 2));
      for (int k = 0; k < lattice.dims[2]; ++k) layer.rate_z.push_back(between(0.5, 2));
      layer.rate_y = 0.7;
    }
    return layer;
  }

  scene::ScalarLayer cloud(const scene::Lattice& lattice) {
    scene::ScalarLayer layer;
    layer.field = field(lattice, 1);
    layer.color = ramp_color(-1, 2, {0.9F, 0.2F, 0.1F}, {0.6F, 0.9F, 1.0F});
    layer.extinction = {
        {0.0, 0.0}, {0.4, between(0.5, 3)}, {0.7, 0.7}, {0.7, between(4, 12)}, {2, 5}};
    layer.min_optical_depth = 1e-4;
    return layer;
  }

  std::array<int, 3> wanted_;  // 0: any
};

int srgb_code(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  const double s = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
  return static_cast<int>(std::lround(255 * s));
}

struct Difference {
  double linear = 0;
  int codes = 0;
  double brightest = 0;
};

Difference compare(const engine::Image& image, const naive::Picture<double>& truth) {
  Difference d;
  for (std::size_t i = 0; i < truth.rgba.size(); ++i) {
    const double a = static_cast<double>(image.rgba[i]);
    d.linear = std::max(d.linear, std::abs(a - truth.rgba[i]));
    if (i % 4 != 3) d.codes = std::max(d.codes, std::abs(srgb_code(a) - srgb_code(truth.rgba[i])));
    d.brightest = std::max(d.brightest, truth.rgba[i]);
  }
  return d;
}

class RandomView : public testing::TestWithParam<std::uint32_t> {};

TEST_P(RandomView, EqualsTheNaiveRenderer) {
  const std::uint32_t seed = GetParam();
  const auto what = static_cast<What>(seed % 6);
  const bool perspective = seed % 4 != 3;
  const bool inside = perspective && seed % 5 == 4;
  const Scene scene = SceneMaker(seed).make(what, perspective, inside);
  const Difference d = compare(render(scene, 2).image, naive::render<double>(scene));
  // Termination at T = 1.5e-4 costs at most that much, float accumulation the rest; far below
  // 1/255.
  EXPECT_LE(d.linear, 5e-4) << "inside " << inside;
  EXPECT_LE(d.codes, 1);
  // A slice or a view outward from inside may be empty; the others may not.
  if (!scene.slice && !inside) {
    EXPECT_GT(d.brightest, 0.02) << "an empty view tests nothing";
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomView, testing::Range(1U, 85U));

// A sphere or a rectangle among the kernels, on every instruction set.
class RandomBody : public testing::TestWithParam<std::uint32_t> {};

TEST_P(RandomBody, EqualsTheNaiveRenderer) {
  const std::uint32_t seed = GetParam();
  Scene scene = SceneMaker(seed).make(static_cast<What>(seed % 6), seed % 4 != 3, seed % 8 == 4);
  scene.slice.reset();
  scene.compositing = static_cast<scene::Compositing>(seed % 4);
  scene.body = scene::Body{};
  scene.body->color = {0.2F, 0.3F, 0.1F};
  scene.body->radius = 0.15 + 0.03 * (seed % 7);
  if (seed % 3 == 0) {
    scene.body->shape = scene::BodyShape::ground;
    scene.body->low = {-0.5, -0.3};
    scene.body->high = {0.4, 0.2};
    scene.body->height = 0.1 - 0.05 * (seed % 5);
  }
  const naive::Picture<double> truth = naive::render<double>(scene);
  for (const engine::kernels::Table* table : engine::kernels::usable_tables()) {
    const Difference d = compare(render_with(*table, scene).image, truth);
    EXPECT_LE(d.linear, 5e-4) << table->name;
    EXPECT_LE(d.codes, 1);
    EXPECT_GT(d.brightest, 0.02) << "an empty view tests nothing";
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomBody, testing::Range(100U, 148U));

// Lines and medium around the eye, close above a rectangle: of many splats the near plane removes
// one part and the body another.
TEST(Inside, LinesAndMediumEndAtTheGround) {
  for (std::uint32_t seed = 1; seed <= 12; ++seed) {
    Scene scene = SceneMaker(seed).make(What::both, true, true);
    scene.slice.reset();
    scene.compositing = static_cast<scene::Compositing>(seed % 4);
    const double angle = 0.7 * seed;
    const glm::dvec3 forward{std::cos(angle), std::sin(angle), -0.4};
    scene.camera = look({0.05, -0.04, 0.02}, forward, 0, 80, 60, true, 0.9);
    scene.camera.near = 0.01;
    scene.body = scene::Body{};
    scene.body->shape = scene::BodyShape::ground;
    scene.body->color = {0.2F, 0.3F, 0.1F};
    scene.body->low = {-0.5, -0.3};
    scene.body->high = {0.4, 0.2};
    scene.body->height = 0.005 - 0.015 * (seed % 4);
    const naive::Picture<double> truth = naive::render<double>(scene);
    for (const engine::kernels::Table* table : engine::kernels::usable_tables()) {
      const Difference d = compare(render_with(*table, scene).image, truth);
      EXPECT_LE(d.linear, 5e-4) << seed << ' ' << table->name;
    }
    scene.body.reset();
    EXPECT_GT(compare(render(scene).image, truth).linear, 0.02) << "the body is not in sight";
  }
}

// Partial rows, and rows whose first and last samples are as far apart as in a full row: samples in
// between must not be read.
struct Rows {
  std::array<int, 3> dims;
  int stride;
  glm::dvec3 forward;
};

class AwkwardRows : public testing::TestWithParam<Rows> {};

TEST_P(AwkwardRows, EqualTheNaiveRenderer) {
  const Rows& rows = GetParam();
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    Scene scene = SceneMaker(seed, rows.dims).make(What::both, true, false);
    scene.slice.reset();
    scene.vector->stride = scene.scalars[0].stride = rows.stride;
    scene.camera = look({0, 0, 0}, rows.forward, 2.0, 90, 70, true, 0.4);
    const Difference d = compare(render(scene, 2).image, naive::render<double>(scene));
    EXPECT_LE(d.linear, 5e-4) << seed;
    EXPECT_GT(d.brightest, 0.02);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Lattices, AwkwardRows,
    testing::Values(Rows{{7, 10, 9}, 1, {1, 0.2, 0.1}}, Rows{{7, 18, 12}, 1, {-1, 0.1, 0.2}},
                    Rows{{9, 12, 16}, 4, {0.1, 0.2, 1}}, Rows{{41, 12, 9}, 4, {0.1, 1, 0.3}},
                    Rows{{14, 13, 12}, 7, {0.1, 0.2, -1}}, Rows{{14, 13, 22}, 8, {0.2, 1, 0.1}},
                    Rows{{15, 9, 22}, 9, {0.1, 0.2, 1}}));

// Inside a medium with a narrow picture: the centres of most visible cells are outside of it, and
// some cells contain the eye.
TEST(Inside, CellsWithOffsetCentersFillThePicture) {
  for (std::uint32_t seed = 1; seed <= 24; ++seed) {
    Scene scene = SceneMaker(seed).make(What::scalars, true, true);
    scene.slice.reset();
    scene.scalars[0].stride = 1 + static_cast<int>(seed % 4);
    const double angle = 0.7 * seed;
    const glm::dvec3 forward{std::cos(angle), std::sin(angle), 0.3 * std::sin(3 * angle)};
    scene.camera = look({0.05, -0.04, 0.03}, forward, 0, 140, 90, true, 0.12);
    scene.camera.near = 0.01;
    const Difference d = compare(render(scene, 2).image, naive::render<double>(scene));
    EXPECT_LE(d.linear, 5e-4) << seed;
  }
}

// Lines pointing almost at the eye, hundredths of a pixel long, with one grey end. Rounding of the
// pixel position must not decide which end is nearer.
TEST(EndOn, LinesKeepTheirColors) {
  Scene scene;
  scene.lattice = even_lattice({24, 18, 6}, {0.1, 0.1, 0.1});
  const glm::dvec3 eye{0.3, -3, 0.4};
  scene.camera = look({0, 0, 0}, -eye, glm::length(eye), 360, 280, true, 0.45);
  scene.vector = plain_lines(
      make_volume(scene.lattice, 3,
                  [&](int c, double x, double y, double z) {
                    const double aside = 0.004 * std::sin(40 * x + 31 * z);
                    const glm::dvec3 wind = eye - glm::dvec3{x, y, z} + glm::dvec3{aside, 0, aside};
                    return static_cast<float>(wind[c] / 3);
                  }),
      {0.9F, 0.4F, 0.1F});
  scene.vector->length = 0.08;
  scene.vector->head_desaturation = 0.9;
  scene.vector->jitter_center = scene.vector->jitter_stride = 0.5;
  scene.stop_transmittance = 0;
  const Difference d = compare(render(scene, 2).image, naive::render<double>(scene));
  EXPECT_LE(d.linear, 1.0 / 255);
  EXPECT_GT(d.brightest, 0.3);
}

// Forward Euler amplifies differences where tau exceeds 1, so pictures are compared below that.
TEST(Euler, EqualsTheNaiveRendererWhereStable) {
  for (const std::uint32_t seed : {2U, 3U, 8U, 15U}) {
    Scene scene = SceneMaker(seed).make(What::both, seed != 3, false);
    scene.compositing = scene::Compositing::cd_euler;
    scene.scalars[0].extinction = {{0, 0}, {1, 3}};
    const Difference d = compare(render(scene, 2).image, naive::render<double>(scene));
    EXPECT_LE(d.linear, 5e-4) << seed;
    EXPECT_GT(d.brightest, 0.02);
  }
}

// Crossing lines may change order between a pixel and the middle of its block: a slab may terminate
// early only if everything left is behind.
TEST(Slabs, TerminateWithinTheirReportedBound) {
  int ended = 0;
  for (std::uint32_t seed = 1; seed <= 120; ++seed) {
    Scene scene = SceneMaker(seed).make(What::both, seed % 2 == 0, false);
    scene.slice.reset();
    scene.method = scene::Method::slab;
    scene.slab_thickness = 2 + seed % 7;
    scene.vector->opacity = 0.5 + 0.1 * (seed % 6);
    scene.vector->length = 0.5 + 0.25 * (seed % 5);
    scene.vector->span = 9;
    scene.vector->r1 = 2 + seed % 7;
    scene.vector->r2 = scene.vector->r1 + 1;
    scene.vector->jitter_center = scene.vector->jitter_stride = 1;
    scene.vector->min_magnitude = 0;
    scene.camera.width = 24;
    scene.camera.height = 16;
    const engine::Rendered early = render(scene);
    scene.stop_transmittance = 0;
    const engine::Rendered whole = render(scene);
    float most = 0;
    for (std::size_t i = 0; i < whole.image.rgba.size(); ++i) {
      most = std::max(most, std::abs(whole.image.rgba[i] - early.image.rgba[i]));
    }
    EXPECT_LE(most, early.work.stop_bound + 2e-5) << seed;
    ended += early.work.stop_bound > 0 ? 1 : 0;
  }
  EXPECT_GT(ended, 20);
}

TEST(Threads, AnyCountGivesTheSameBits) {
  for (const std::uint32_t seed : {2U, 5U, 16U, 23U}) {
    Scene scene = SceneMaker(seed).make(What::both, seed != 5, false);
    if (seed > 10) scene.method = scene::Method::slab;
    const engine::Rendered one = render(scene, 1);
    for (const unsigned threads : {2U, 3U, 7U}) {
      const engine::Rendered many = render(scene, threads);
      EXPECT_EQ(one.image.rgba, many.image.rgba) << threads;
      EXPECT_EQ(one.work.pixel_updates, many.work.pixel_updates);
      EXPECT_EQ(one.work.exponentials, many.work.exponentials);
      EXPECT_EQ(one.work.occluded, many.work.occluded);
      EXPECT_EQ(one.work.skipped_both, many.work.skipped_both);
      EXPECT_EQ(one.work.skipped_bound, many.work.skipped_bound);
    }
  }
}

}  // namespace
}  // namespace windsplat::test
