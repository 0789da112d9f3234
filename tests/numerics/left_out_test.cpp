// Hidden content costs nothing, and tolerances and early termination change the picture by at most
// the reported bound.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "server/engine/plan.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/trial_fields.hpp"

namespace windsplat::test {
namespace {

using scene::Compositing;
using scene::Method;
using scene::Scene;

Scene wind_and_cloud(Method method) {
  Scene scene;
  scene.lattice = even_lattice({12, 10, 6}, {0.15, 0.15, 0.15});
  scene.camera = look({0, 0, 0}, {0.2, 1, -0.3}, 5, 90, 70, true, 0.3);
  scene.vector =
      plain_lines(make_volume(scene.lattice, 3,
                              [](int c, double, double, double) { return c == 1 ? 0.F : 1.F; }),
                  {1.0F, 1.0F, 1.0F});
  scene.vector->length = 0.2;
  scene.scalars.push_back(
      medium(make_volume(scene.lattice, 1, [](int, double, double, double) { return 0.8F; }),
             {0.5F, 0.7F, 1.0F}));
  scene.method = method;
  scene.stop_transmittance = 0;  // lines alone: nothing is hidden, so the counts are comparable
  return scene;
}

bool names(const engine::Variant& variant, const std::string& word) {
  return engine::text_of(variant).find(word) != std::string::npos;
}

class EitherMethod : public testing::TestWithParam<Method> {};

TEST_P(EitherMethod, WithoutAScalarNoMediumIsPreparedOrComputed) {
  Scene scene = wind_and_cloud(GetParam());
  const engine::WorkReport both = render(scene).work;
  EXPECT_GT(both.exponentials, 0);
  EXPECT_TRUE(names(both.variant, "scalar"));
  scene.scalars.clear();
  engine::RenderPlan plan;
  engine::make_plan(scene, plan);
  ASSERT_EQ(plan.passes.size(), 1U);
  EXPECT_EQ(plan.passes[0].kernel.has_medium, 0);
  EXPECT_EQ(plan.passes[0].kernel.medium.layers, 0);
  EXPECT_TRUE(plan.passes[0].layers.empty());
  EXPECT_FALSE(plan.perspective_medium) << "only a medium has ray lengths";
  for (const auto compositing : {Compositing::simple, Compositing::cd_naive, Compositing::cd,
                                 Compositing::analytic, Compositing::cd_euler}) {
    scene.compositing = compositing;
    const engine::WorkReport work = render(scene).work;
    EXPECT_EQ(work.exponentials, 0);
    EXPECT_EQ(work.skipped_scalar, 0);
    EXPECT_GT(work.pixel_updates, 0);
    EXPECT_LT(work.pixel_updates, both.pixel_updates);
    EXPECT_TRUE(names(work.variant, "vector"));
    EXPECT_FALSE(names(work.variant, "scalar")) << engine::text_of(work.variant);
  }
}

TEST_P(EitherMethod, WithoutAVectorNoLineIsPreparedOrComputed) {
  Scene scene = wind_and_cloud(GetParam());
  const engine::WorkReport both = render(scene).work;
  scene.vector.reset();
  engine::RenderPlan plan;
  engine::make_plan(scene, plan);
  ASSERT_EQ(plan.passes.size(), 1U);
  EXPECT_EQ(plan.passes[0].kernel.has_lines, 0);
  for (const float* component : plan.passes[0].kernel.line.velocity) EXPECT_EQ(component, nullptr);
  EXPECT_TRUE(plan.passes[0].line_rgb.empty());
  EXPECT_TRUE(plan.passes[0].rate_x.empty() && plan.passes[0].rate_z.empty());
  const engine::WorkReport work = render(scene).work;
  EXPECT_EQ(work.skipped_vector, 0);
  EXPECT_LE(work.pixel_updates, both.pixel_updates);
  EXPECT_FALSE(names(work.variant, "vector")) << engine::text_of(work.variant);
  // At most one exponential per update; those of lines are excluded.
  EXPECT_GT(work.exponentials, 0);
  EXPECT_LT(work.exponentials, both.exponentials);
  EXPECT_LE(work.exponentials, work.pixel_updates);
  scene.compositing = Compositing::cd;
  EXPECT_EQ(render(scene).work.exponentials, work.exponentials)
      << "the rule of a line was evaluated";
}

// The exact integral inside a line needs a second exponential; the other rules must not use one.
TEST_P(EitherMethod, OnlyTheAnalyticRuleEvaluatesASecondExponential) {
  Scene scene = wind_and_cloud(GetParam());
  const auto exponentials = [&](Compositing compositing) {
    scene.compositing = compositing;
    return render(scene).work.exponentials;
  };
  const std::int64_t one = exponentials(Compositing::cd);
  EXPECT_EQ(exponentials(Compositing::simple), one);
  EXPECT_GT(exponentials(Compositing::analytic), one);
}

TEST_P(EitherMethod, SliceVisitsItsLayerOnly) {
  Scene scene = wind_and_cloud(GetParam());
  const int dims[3] = {12, 10, 6};
  for (int axis = 0; axis < 3; ++axis) {
    scene.slice = scene::Slice{axis, dims[axis] / 2};
    EXPECT_EQ(render(scene).work.samples, 12 * 10 * 6 / dims[axis]);
  }
}

INSTANTIATE_TEST_SUITE_P(LeftOut, EitherMethod, testing::Values(Method::kernel, Method::slab),
                         [](const auto& test) {
                           return test.param == Method::kernel ? "kernel" : "slab";
                         });

// Random lattices, winds, clouds and cameras; many values are below tolerance.
class Weak {
 public:
  explicit Weak(std::uint32_t seed) : random_(seed) {}

  Scene make(bool lines, bool fog, bool perspective) {
    Scene scene;
    std::array<std::vector<double>, 3> spacing;
    for (auto& axis : spacing) {
      const double cell = std::pow(10.0, between(-2.7, -0.9));  // from below one pixel to far above
      for (int n = whole(1, 14); n >= 0; --n) axis.push_back(cell * between(0.7, 1.3));
    }
    scene.lattice = make_lattice(spacing);
    if (whole(0, 3) == 0) bend(scene.lattice);
    const glm::dvec3 forward{between(-1, 1), between(-1, 1), between(-1, 1)};
    scene.camera = look({0, 0, 0}, forward, between(0.3, 5), whole(40, 120), whole(40, 120),
                        perspective, perspective ? between(0.1, 0.6) : between(0.2, 0.9));
    scene.method = whole(0, 1) == 0 ? Method::kernel : Method::slab;
    scene.compositing = static_cast<Compositing>(whole(0, 3));
    scene.stop_transmittance = 0;
    const double k = between(2, 7);
    if (lines) {
      scene.vector = plain_lines(make_volume(scene.lattice, 3, wave(k)), {1.0F, 0.9F, 0.2F});
      scene.vector->length = between(0.02, 0.4);
      scene.vector->magnitude_range = {0, between(0.5, 2)};
      scene.vector->min_magnitude = between(0.2, 1.2);
      scene.vector->opacity = between(0.1, 1);
      scene.vector->r1 = between(0, 2);
      scene.vector->r2 = scene.vector->r1 + between(1, 2);
      scene.vector->span = between(1, 7);
      scene.vector->jitter_center = scene.vector->jitter_stride = between(0, 1);
      scene.vector->moving = whole(0, 2) == 0;
      scene.vector->stride = whole(1, 2);
    }
    if (fog) {
      scene.scalars.push_back(medium(make_volume(scene.lattice, 1, wave(k)), {0.3F, 0.8F, 1.0F}));
      const double dense = std::pow(10.0, between(-1, 1.5));
      scene.scalars[0].extinction = {{0, 0}, {2, 2 * dense}};
      scene.scalars[0].min_optical_depth = dense * between(0.005, 0.1);
      scene.scalars[0].stride = whole(1, 2);
    }
    return scene;
  }

 private:
  // Shears and waves, so that cells are not axis-aligned.
  void bend(scene::Lattice& lattice) {
    auto places = std::make_shared<std::vector<std::array<float, 3>>>();
    const double wave = between(0, 0.1);
    for (const double z : lattice.positions[2]) {
      for (const double y : lattice.positions[1]) {
        for (const double x : lattice.positions[0]) {
          places->push_back({static_cast<float>(x + 0.4 * z), static_cast<float>(y - 0.3 * x),
                             static_cast<float>(z + wave * std::sin(4 * x + 3 * y))});
        }
      }
    }
    lattice.places = places;
  }

  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  std::function<float(int, double, double, double)> wave(double k) {
    const double phase = between(0, 6);
    return [=](int c, double x, double y, double z) {
      const double a = phase + 2.1 * c;
      return static_cast<float>(std::sin(k * x + a) * std::cos(k * y - a) + std::sin(k * z + a));
    };
  }

  std::mt19937 random_;
};

struct Change {
  double mean = 0;     // maximum over pixels and channels
  double largest = 0;  // of any channel
};

Change between(const engine::Image& a, const engine::Image& b) {
  Change change;
  for (std::size_t i = 0; i < a.rgba.size(); i += 4) {
    double most = 0;
    for (std::size_t c = i; c < i + 4; ++c) {
      most = std::max(most, static_cast<double>(std::abs(a.rgba[c] - b.rgba[c])));
    }
    change.mean += most;
    change.largest = std::max(change.largest, most);
  }
  change.mean /= static_cast<double>(a.rgba.size()) / 4;
  return change;
}

// Sums of a few hundred floats in [0, 1].
constexpr double float_noise = 2e-6;

TEST(LeftOut, WeakLinesAndThinMediaStayWithinTheirBound) {
  int tight = 0;
  int changed = 0;
  for (std::uint32_t seed = 0; seed < 240; ++seed) {
    Scene scene = Weak(seed).make(seed % 3 != 1, seed % 3 != 0, seed % 2 == 0);
    const engine::Rendered less = render(scene, 2);
    if (scene.vector) scene.vector->min_magnitude = 0;
    for (auto& scalar : scene.scalars) scalar.min_optical_depth = 0;
    const engine::Rendered full = render(scene, 2);
    EXPECT_EQ(full.work.skipped_bound, 0) << "nothing was omitted: " << seed;
    const Change change = between(less.image, full.image);
    const double bound = less.work.skipped_bound;
    EXPECT_LE(change.mean, bound + float_noise)
        << "seed " << seed << ' ' << engine::text_of(less.work.variant);
    if (change.mean > 1e-4) ++changed;
    if (change.mean > 1e-4 && change.mean > 0.1 * bound) ++tight;
  }
  EXPECT_GT(changed, 40) << "the scenes contain little below tolerance";
  EXPECT_GT(tight, changed / 4) << "the bound is never approached";
}

// The alphas of the vectors that are left out for clarity add up to several times the picture.
TEST(LeftOut, BoundIsWithinAFactorOfFourWhereMostVectorsAreLeftOut) {
  int views = 0;
  for (const TrialField& field : trial_fields()) {
    // Those that are generated quickly.
    if (field.name.find("noise") == std::string::npos && !field.name.starts_with("she") &&
        field.name != "plume") {
      continue;
    }
    const auto dataset = trial_dataset(field);
    protocol::View view;
    view.dataset = field.name;
    view.image.width = 160;
    view.image.height = 120;
    view.method.name = protocol::MethodName::kernel;
    view.vector.stride = 1;
    view.vector.length = 0.05;
    view.scalars.emplace();
    auto completed = scene::complete(view, *dataset).value();
    const double top = completed.view().vector.magnitude_range.value()[1];
    completed =
        completed.with([&](protocol::View& by) { by.vector.min_magnitude = 0.9 * top; }).value();
    for (const double azimuth : {0.0, 70.0}) {
      const auto turned = completed.with(
          [&](protocol::View& by) { scene::orbit(by, completed.lattice(), azimuth, 20, 1); });
      Scene scene = scene::build_scene(turned.value(), *dataset).value();
      const engine::Rendered less = render(scene, 2);
      scene.vector->min_magnitude = 0;
      const double change = between(less.image, render(scene, 2).image).mean;
      ASSERT_GT(change, 0.05) << field.name;
      EXPECT_GE(less.work.skipped_bound, change) << field.name;
      EXPECT_LE(less.work.skipped_bound, 4 * change) << field.name << ' ' << azimuth;
      ++views;
    }
  }
  EXPECT_EQ(views, 8);
}

// Bricks behind each other change the pixels of one; beside each other those of all.
TEST(LeftOut, BoundCountsPixelsOnce) {
  const auto bound = [](std::array<int, 3> dims) {
    Scene scene;
    scene.lattice = even_lattice(dims, {0.05, 0.05, 0.05});
    scene.camera = look({0, 0, 0}, {0, 1, 0}, 5, 64, 64, false, 1);
    scene.vector =
        plain_lines(make_volume(scene.lattice, 3,
                                [](int c, double, double, double) { return c == 0 ? 1.F : 0.F; }),
                    {1.0F, 1.0F, 1.0F});
    scene.vector->length = 0.1;
    scene.vector->min_magnitude = 2;
    return render(scene).work.skipped_bound;
  };
  const double one = bound({8, 1, 8});
  EXPECT_LT(one, 0.3) << "a fifth of the edge of the picture, and the reach of lines";
  EXPECT_EQ(bound({8, 40, 8}), one);
  EXPECT_GT(bound({24, 1, 8}), 1.8 * one);
}

// A pixel whose centre hits a splat smaller than itself shows the peak of the splat.
TEST(LeftOut, SplatNarrowerThanAPixelIsBoundedByItsPeak) {
  for (const bool perspective : {false, true}) {
    for (const double cell : {0.1, 0.01, 0.001}) {
      Scene scene;
      scene.lattice = even_lattice({1, 1, 1}, {cell, cell, cell});
      scene.camera = look({0, 0, 0}, {0, 1, 0}, 2, 33, 33, perspective, perspective ? 0.5 : 1);
      const double rho = 1e-2 / cell;
      scene.scalars.push_back(
          medium(make_volume(scene.lattice, 1,
                             [=](int, double, double, double) { return static_cast<float>(rho); }),
                 {1.0F, 1.0F, 1.0F}));
      const engine::Rendered full = render(scene);
      scene.scalars[0].min_optical_depth = 1;
      const engine::Rendered less = render(scene);
      const Change change = between(less.image, full.image);
      EXPECT_NEAR(change.largest, 1 - std::exp(-1e-2 / 1.4476982547), 2e-4) << "the peak";
      EXPECT_LE(change.mean, less.work.skipped_bound) << cell << ' ' << perspective;
      EXPECT_GE(change.mean, 0.3 * less.work.skipped_bound) << cell << ' ' << perspective;
    }
  }
}

TEST(LeftOut, EarlyTerminationStaysWithinItsBound) {
  int stopped = 0;
  for (std::uint32_t seed = 200; seed < 260; ++seed) {
    Scene scene = Weak(seed).make(seed % 3 != 1, true, seed % 2 == 0);
    scene.scalars[0].extinction = {{-3, 40}, {3, 90}};
    scene.scalars[0].min_optical_depth = 0;
    const engine::Rendered full = render(scene, 2);
    EXPECT_EQ(full.work.stop_bound, 0);
    scene.stop_transmittance = std::pow(10.0, -1.0 - static_cast<double>(seed % 4));
    const engine::Rendered less = render(scene, 2);
    const Change change = between(less.image, full.image);
    EXPECT_LE(change.largest, less.work.stop_bound + float_noise) << "seed " << seed;
    EXPECT_LE(less.work.stop_bound, scene.stop_transmittance * (1 + 1e-6));
    if (change.largest > 0.01 * less.work.stop_bound) ++stopped;
  }
  EXPECT_GT(stopped, 15) << "the scenes are not dense enough for early termination";
}

}  // namespace
}  // namespace windsplat::test
