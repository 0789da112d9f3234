// The sample that a pixel shows, compared with closed forms and with every kernel of the scene.
#include "server/frame/pick/pick.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "server/engine/reference/profile.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/frame/ray_kernels.hpp"
#include "server/scene/scene.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::frame {
namespace {

namespace reference = engine::reference;
using scene::Scene;
using test::even_lattice;
using test::make_volume;

constexpr int side = 9;  // samples along each axis, 0.2 apart

// Seen from the south, level, in parallel projection: x to the right, z upwards, 0.02 world units
// to a pixel. The middle of the picture is sample 4, 4, 4.
Scene front_view() {
  Scene scene;
  scene.lattice = even_lattice({side, side, side}, {0.2, 0.2, 0.2});
  scene.camera = test::look({0, 0, 0}, {0, 1, 0}, 4, 99, 99, false, 1);
  return scene;
}

// Eastward vectors at x = z = 0 in some layers of y, as fast as told.
void add_lines(Scene& scene, const std::vector<std::pair<int, float>>& at, double opacity) {
  const auto value = [&](int c, double x, double y, double z) {
    if (c > 0 || std::abs(x) > 0.01 || std::abs(z) > 0.01) return 0.0F;
    for (const auto& [layer, speed] : at) {
      if (std::abs(y - 0.2 * (layer - 4)) < 0.01) return speed;
    }
    return 0.0F;
  };
  scene.vector = test::plain_lines(make_volume(scene.lattice, 3, value), {1, 1, 1});
  scene.vector->length = 0.3;
  scene.vector->magnitude_range = {0, 1};
  scene.vector->opacity = opacity;
}

// Chains of straight segments, each of one magnitude, as drawn lines that were followed through a
// field. The middle of a segment is nearest to the sample that `nearest` numbers.
struct ChainOfTest {
  std::vector<glm::dvec3> places;
  float magnitude = 1;
  std::uint32_t nearest = 0;
};

std::shared_ptr<const trace::Segments> segments_of(const std::vector<ChainOfTest>& chains) {
  trace::Segments out;
  for (const ChainOfTest& chain : chains) {
    const std::size_t count = chain.places.size();
    for (std::size_t n = 0; n < count; ++n) {
      const glm::dvec3& at = chain.places[n];
      const bool inner = n > 0 && n + 1 < count;
      const glm::dvec3 way = inner ? glm::normalize(chain.places[n + 1] - at) +
                                         glm::normalize(at - chain.places[n - 1])
                                   : glm::dvec3(0);
      out.places.push_back(
          {static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z)});
      for (int c = 0; c < 3; ++c) out.tangents.at(c).push_back(static_cast<float>(way[c]));
      out.q.push_back(static_cast<float>(n) / static_cast<float>(count - 1) - 0.5F);
      out.magnitudes.push_back(n + 1 < count ? chain.magnitude : trace::Segments::none);
      out.phases.push_back(0);
      out.colors.push_back(chain.magnitude);
      out.samples.push_back(chain.nearest);
      if (n > 0) out.longest = std::max(out.longest, glm::length(at - chain.places[n - 1]));
    }
  }
  return std::make_shared<const trace::Segments>(std::move(out));
}

std::optional<Picked> picked(const Scene& scene, double x, double y) {
  const auto found = pick(scene, x, y, {});
  EXPECT_TRUE(found);
  return found ? *found : std::nullopt;
}

TEST(Pick, TheNearestOpaqueLineHidesTheOthers) {
  Scene scene = front_view();
  add_lines(scene, {{2, 5.0F}, {6, 40.0F}}, 1);
  const auto found = picked(scene, 49.5, 49.5);
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->medium);
  EXPECT_EQ(found->sample, (std::array{4, 2, 4}));
  EXPECT_EQ(found->value, 5);
  EXPECT_DOUBLE_EQ(found->share, 1);
  EXPECT_NEAR(found->depth, 4 - 0.4, 1e-6);
  EXPECT_NEAR(found->at[0], 49.5, 1e-6);
  EXPECT_NEAR(found->at[1], 49.5, 1e-6);
}

TEST(Pick, ATransparentLineGivesWayToOneThatContributesMore) {
  Scene scene = front_view();
  add_lines(scene, {{1, 3.0F}, {5, 3.0F}, {7, 3.0F}}, 0.2);
  // 0.2, 0.16, 0.128 of the opacity.
  EXPECT_EQ(picked(scene, 49.5, 49.5)->sample, (std::array{4, 1, 4}));
  EXPECT_NEAR(picked(scene, 49.5, 49.5)->share, 0.2 / (1 - 0.8 * 0.8 * 0.8), 1e-12);
}

TEST(Pick, AnEmptyPixelHasNoFeature) {
  Scene scene = front_view();
  add_lines(scene, {{4, 5.0F}}, 1);
  EXPECT_TRUE(picked(scene, 49.5 + 6, 49.5));
  EXPECT_FALSE(picked(scene, 49.5 + 12, 49.5));
  EXPECT_FALSE(picked(scene, 49.5, 49.5 + 4));
}

// Vectors below minMagnitude are not drawn.
TEST(Pick, WhatIsNotDrawnIsNotPicked) {
  Scene scene = front_view();
  add_lines(scene, {{2, 5.0F}, {6, 40.0F}}, 1);
  scene.vector->min_magnitude = 15;
  EXPECT_EQ(picked(scene, 49.5, 49.5)->value, 40);
}

// A line through the sample in the middle was followed 0.4 above it, 19.8 pixels of 2 / 99.
TEST(Pick, LinesThatAreFollowedArePickedWhereTheyRun) {
  Scene scene = front_view();
  add_lines(scene, {{4, 5.0F}}, 0.75);
  scene.vector->streamlets =
      segments_of({{{{-0.5, 0, 0.4}, {-0.1, 0, 0.4}, {0.3, 0, 0.4}, {0.5, 0, 0.6}},
                    7.5F,
                    4 + 9 * (4 + 9 * 6)}});
  EXPECT_FALSE(picked(scene, 49.5, 49.5));  // the straight line through the sample is not drawn
  for (const double x : {37.5, 44.5, 49.5, 60.5}) {
    const auto found = picked(scene, x, 49.5 - 20);
    ASSERT_TRUE(found) << x;
    EXPECT_FALSE(found->medium);
    EXPECT_EQ(found->value, 7.5);
    EXPECT_EQ(found->sample, (std::array{4, 4, 6}));
    EXPECT_NEAR(found->share, 1, 1e-9);
    EXPECT_NEAR(found->depth, 4, 1e-6);
    EXPECT_NEAR(found->at[0], x, 1e-4);
    EXPECT_NEAR(found->at[1], 49.5 - 19.8, 1e-4);
    EXPECT_NEAR(found->place[0], 2.0 / 99 * (x - 49.5), 1e-5);
    EXPECT_NEAR(found->place[2], 0.4, 1e-5);
  }
  EXPECT_FALSE(picked(scene, 37.5, 49.5 - 24));
}

// A line of opacity o behind a medium of opacity A has the share (1 - A) o of 1 - (1 - A)(1 - o).
TEST(Pick, ALineBehindAMediumHasTheShareThatTheMediumLeaves) {
  Scene scene = front_view();
  scene.camera = test::look({0, 0, 0}, {0, 1, 0}, 4, 3, 3, false, 3.0 / 99);
  const auto before = [](int, double, double y, double) { return y < -0.3 ? 0.5F : 0.0F; };
  scene.scalars = {test::medium(make_volume(scene.lattice, 1, before), {0.5F, 0.5F, 0.5F})};
  ThreadPool pool(1);
  const auto alone = reference::render(scene, pool, {});
  ASSERT_TRUE(alone);
  const double opacity = alone->rgba[4 * (1 * 3 + 1) + 3];
  ASSERT_GT(opacity, 0.1);
  ASSERT_LT(opacity, 0.5);
  add_lines(scene, {{7, 5.0F}}, 0.7);
  const auto found = picked(scene, 1.5, 1.5);
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->medium);
  EXPECT_NEAR(found->share, (1 - opacity) * 0.7 / (1 - (1 - opacity) * 0.3), 2e-3);
}

// Of two media, the field of the denser one at the sample.
TEST(Pick, AMediumIsPickedWithTheFieldThatAbsorbsMost) {
  Scene scene = front_view();
  const auto spot = [](float value) {
    return [value](int, double x, double y, double z) {
      const bool here = std::abs(x) < 0.01 && std::abs(y - 0.2) < 0.01 && std::abs(z) < 0.01;
      return here ? value : 0.0F;
    };
  };
  scene.scalars = {test::medium(make_volume(scene.lattice, 1, spot(1)), {1, 0, 0}),
                   test::medium(make_volume(scene.lattice, 1, spot(3)), {0, 1, 0})};
  const auto found = picked(scene, 49.5, 49.5);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->medium, std::optional<std::size_t>(1));
  EXPECT_EQ(found->sample, (std::array{4, 5, 4}));
  EXPECT_EQ(found->value, 3);
  EXPECT_NEAR(found->share, 0.75, 1e-9);
  EXPECT_NEAR(found->depth, 4.2, 0.03);  // its front absorbs more
}

TEST(Pick, TheGroundHidesWhatLiesBehindIt) {
  Scene scene = front_view();
  add_lines(scene, {{6, 5.0F}}, 1);
  scene.body = scene::Body{};
  scene.body->radius = 0.3;
  EXPECT_FALSE(picked(scene, 49.5, 49.5));
  add_lines(scene, {{1, 5.0F}}, 0.5);
  const auto found = picked(scene, 49.5, 49.5);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->share, 0.5, 1e-9);  // the other half is the ground
}

// A section across the view at `y`, of two triangles that touch in the middle of the picture, with
// the values 10 + 5 x + 2 z.
surface::Shown section_at(double y, double opacity) {
  surface::Mesh mesh;
  for (const auto& [x, z] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}) {
    mesh.places.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
    mesh.normals.push_back({0, 1, 0});
    mesh.values.push_back(static_cast<float>(10 + 5 * x + 2 * z));
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  surface::Shown shown;
  shown.mesh = std::make_shared<const surface::Mesh>(std::move(mesh));
  shown.opacity = opacity;
  shown.colors = {{0.5F, 0.5F, 0.5F}};
  return shown;
}

TEST(Pick, AnOpaqueSectionHidesWhatLiesBehindItAndIsPicked) {
  Scene scene = front_view();
  add_lines(scene, {{6, 5.0F}}, 1);
  scene.surfaces = {section_at(0, 1)};
  const auto found = picked(scene, 49.5, 49.5);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->surface, std::optional<std::size_t>(0));
  EXPECT_FALSE(found->medium);
  EXPECT_NEAR(found->value, 10, 1e-6);
  EXPECT_NEAR(found->share, 1, 1e-12);
  EXPECT_NEAR(found->depth, 4, 1e-9);
  constexpr double away = 10 * 2.0 / 99;  // 10 pixels
  const auto aside = picked(scene, 59.5, 39.5);
  ASSERT_TRUE(aside);
  EXPECT_NEAR(aside->value, 10 + 7 * away, 1e-6);
  EXPECT_NEAR(aside->place[0], away, 1e-9);
  EXPECT_NEAR(aside->place[1], 0, 1e-9);
  EXPECT_NEAR(aside->place[2], away, 1e-9);
  EXPECT_EQ(aside->at, (std::array{59.5, 39.5}));
  EXPECT_FALSE(picked(scene, 49.5 + 26, 49.5));  // beside it
}

TEST(Pick, ALineBeforeASectionIsPickedAndSoIsOneThatItHardlyHides) {
  Scene scene = front_view();
  add_lines(scene, {{2, 5.0F}}, 1);
  scene.surfaces = {section_at(0, 1)};
  EXPECT_FALSE(picked(scene, 49.5, 49.5)->surface);
  EXPECT_EQ(picked(scene, 49.5, 49.5)->value, 5);
  // Behind a section of opacity o a line that is opaque has the share 1 - o.
  scene.surfaces = {section_at(-0.6, 0.25)};
  EXPECT_FALSE(picked(scene, 49.5, 49.5)->surface);
  EXPECT_NEAR(picked(scene, 49.5, 49.5)->share, 0.75, 1e-9);
  scene.surfaces = {section_at(-0.6, 0.6)};
  EXPECT_TRUE(picked(scene, 49.5, 49.5)->surface);
  EXPECT_NEAR(picked(scene, 49.5, 49.5)->share, 0.6, 1e-9);
}

// Of two sections of opacity 0.5 the nearer, with 0.5 of 0.75; of one behind the eye nothing.
TEST(Pick, SectionsCountFromTheEyeOnwards) {
  Scene scene = front_view();
  scene.surfaces = {section_at(0.4, 0.5), section_at(-0.4, 0.5)};
  EXPECT_EQ(picked(scene, 45.5, 49.5)->surface, std::optional<std::size_t>(1));
  EXPECT_NEAR(picked(scene, 45.5, 49.5)->share, 2.0 / 3, 1e-9);
  scene.camera = test::look({0, 0, 0}, {0, 1, 0}, 0.1, 99, 99, true, 0.5);
  EXPECT_EQ(picked(scene, 45.5, 49.5)->surface, std::optional<std::size_t>(0));
  EXPECT_NEAR(picked(scene, 45.5, 49.5)->depth, 0.5, 1e-6);
  scene.surfaces = {section_at(-0.4, 0.5)};
  EXPECT_FALSE(picked(scene, 45.5, 49.5));
}

// Lines that are combined by `or` are so between one section and the next.
TEST(Pick, CombinedLinesBehindAnOpaqueSectionAreNotPicked) {
  Scene scene = front_view();
  add_lines(scene, {{2, 5.0F}, {6, 40.0F}}, 0.5);
  scene.vector->combine_or = true;
  scene.vector->magnitude_range = {0, 40};
  scene.vector->magnitude_intensity = 1;
  scene.vector->length = 2.4;
  EXPECT_EQ(picked(scene, 49.5, 49.5)->value, 40);  // the brighter
  scene.surfaces = {section_at(0, 1)};
  scene.vector->opacity = 0.8;
  const auto found = picked(scene, 49.5, 49.5);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->value, 5);
  EXPECT_NEAR(found->share, 0.8, 1e-9);
}

TEST(Pick, CancelledPicksEndWithAnError) {
  Scene scene = front_view();
  add_lines(scene, {{6, 5.0F}}, 1);
  const CancelToken cancel;
  cancel.cancel();
  const auto found = pick(scene, 49.5, 49.5, cancel);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::cancelled);
}

// The largest contribution to a pixel of all kernels of the scene, followed in small steps; each
// splat has the medium that list_kernels() gives it.
struct Strongest {
  double weight = 0;
  double share = 0;  // of the opacity of the pixel
};

Strongest strongest_of_all(const Scene& scene, const reference::Kernels& kernels, int x, int y) {
  const reference::View view = reference::make_view(scene.camera);
  const PictureRay ray = picture_ray(view, x + 0.5, y + 0.5);
  std::vector<reference::RibbonHit<double>> hits;
  for (const auto& line : kernels.ribbons) {
    const auto hit = reference::hit_ribbon(line, ray.x, ray.y);
    if (hit.opacity > 0) hits.push_back(hit);
  }
  std::sort(hits.begin(), hits.end(), [](auto& a, auto& b) { return a.depth < b.depth; });
  std::vector<SplatOnRay> splats;
  for (const auto& splat : kernels.splats) {
    const SplatOnRay on = splat_on_ray(splat, ray);
    if (on.tau > 0) splats.push_back(on);
  }
  std::vector<double> weights(splats.size());
  std::vector<double> parts(splats.size());
  Strongest out;
  double left = 1;
  std::size_t next = 0;
  const auto cross = [&] {
    const double seen = left * hits[next].opacity;
    out.weight = std::max(out.weight, seen);
    left -= seen;
    ++next;
  };
  static const reference::Profile profile;
  constexpr int steps = 4000;
  constexpr double from = 1;
  constexpr double to = 7;
  for (int n = 0; n < steps; ++n) {
    const double z = from + (to - from) * (n + 0.5) / steps;
    while (next < hits.size() && hits[next].depth < z) cross();
    double tau = 0;
    for (std::size_t s = 0; s < splats.size(); ++s) {
      const double off = z - splats[s].middle;
      parts[s] = splats[s].rho * profile(splats[s].least2 + splats[s].cells2 * off * off) *
                 (to - from) / steps;
      tau += parts[s];
    }
    if (tau <= 0) continue;
    const double absorbed = -std::expm1(-tau) * left;
    for (std::size_t s = 0; s < splats.size(); ++s) weights[s] += absorbed * parts[s] / tau;
    left -= absorbed;
  }
  while (next < hits.size()) cross();
  for (const double weight : weights) out.weight = std::max(out.weight, weight);
  out.share = out.weight / std::max(1 - left, 1e-300);
  return out;
}

void expect_strongest_everywhere(const Scene& scene) {
  const reference::View view = reference::make_view(scene.camera);
  const reference::Kernels kernels = reference::list_kernels(scene, view);
  int lines = 0;
  int media = 0;
  for (int y = 2; y < scene.camera.height; y += 5) {
    for (int x = 2; x < scene.camera.width; x += 5) {
      const Strongest expected = strongest_of_all(scene, kernels, x, y);
      const auto found = picked(scene, x + 0.9, y + 0.1);
      if (std::abs(expected.weight - picked_least) < 1e-5) continue;
      ASSERT_EQ(found.has_value(), expected.weight > picked_least) << x << ' ' << y;
      if (!found) continue;
      EXPECT_NEAR(found->share, expected.share, 2e-3) << x << ' ' << y;
      ++(found->medium ? media : lines);
    }
  }
  EXPECT_GT(lines, 10);
  EXPECT_GT(media, 10);
}

TEST(Pick, NoOtherKernelContributesMore) { expect_strongest_everywhere(test::cloudy_scene(8, 60)); }

// Lines that wind through a medium, beside which the eye is close to some.
TEST(Pick, NoOtherSegmentContributesMore) {
  Scene scene = test::cloudy_scene(8, 60);
  std::vector<ChainOfTest> chains;
  for (int n = 0; n < 60; ++n) {
    ChainOfTest chain;
    chain.magnitude = 0.1F * static_cast<float>(n % 7 + 1);
    const double radius = 0.1 + 0.015 * n;
    for (int step = 0; step <= 12; ++step) {
      const double turn = 0.5 * step + 1.7 * n;
      chain.places.emplace_back(radius * std::cos(turn), radius * std::sin(turn),
                                0.15 * step - 0.9 + 0.003 * n);
    }
    chains.push_back(std::move(chain));
  }
  scene.vector->streamlets = segments_of(chains);
  expect_strongest_everywhere(scene);
}

TEST(Pick, NoOtherKernelOfACurvedLatticeContributesMore) {
  Scene scene = test::cloudy_scene(8, 60);
  test::displace(scene.lattice, [](const glm::dvec3& p) {
    return glm::dvec3(p.x + 0.2 * std::sin(2 * p.y), p.y, p.z + 0.25 * std::cos(3 * p.x));
  });
  expect_strongest_everywhere(scene);
}

TEST(Pick, NoOtherKernelOfAnUnevenLatticeWithStridesContributesMore) {
  Scene scene = test::cloudy_scene(9, 60);
  const std::vector<double> uneven{0.1, 0.1, 0.2, 0.3, 0.3, 0.4, 0.2, 0.2, 0.2};
  scene.lattice = test::make_lattice({uneven, uneven, uneven});
  scene.vector->stride = 2;
  scene.vector->jitter_stride = 0.3;
  expect_strongest_everywhere(scene);
}

}  // namespace
}  // namespace windsplat::frame
