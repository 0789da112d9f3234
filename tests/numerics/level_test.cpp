// Coarser levels compared with full detail over the trial fields, by whole views with their
// defaults.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "server/frame/cost.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/trial_fields.hpp"

namespace windsplat::test {
namespace {

enum class Shown { lines, medium, both };

protocol::View small_view(const TrialField& field, Shown shown) {
  protocol::View view;
  view.dataset = field.name;
  view.image.width = 96;
  view.image.height = 72;
  view.method.stop_transmittance = 0;
  view.vector.stride = 1;  // lines alone with a stride are not merged
  if (shown == Shown::medium) view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  view.scalars.emplace();
  if (shown != Shown::lines) {
    view.scalars->emplace_back();
    view.scalars->back().field = "cloud";
    view.scalars->back().min_optical_depth = 0;  // would leave out thin cells at full detail
  }
  return view;
}

// Mean premultiplied colour and opacity of a picture.
std::array<double, 4> mean(const engine::Image& image) {
  std::array<double, 4> sum{};
  for (std::size_t i = 0; i < image.rgba.size(); ++i) sum[i % 4] += image.rgba[i];
  for (double& s : sum) s *= 4.0 / static_cast<double>(image.rgba.size());
  return sum;
}

struct Compared {
  double opacity = 0;  // ratio of the mean opacities
  double color = 0;    // largest difference of the mean colour, relative to its brightest channel
  std::array<int, 3> level{};
};

Compared compare(const TrialField& field, Shown shown, data::Dataset& dataset) {
  const auto completed = scene::complete(small_view(field, shown), dataset).value();
  const auto full =
      completed.with([](protocol::View& view) { view.method.detail = protocol::Detail::full; });
  auto coarse_scene = scene::build_scene(completed, dataset).value();
  auto full_scene = scene::build_scene(full.value(), dataset).value();
  coarse_scene.method = full_scene.method = scene::Method::slab;
  const auto at_level = mean(render(coarse_scene, 2).image);
  const auto whole = mean(render(full_scene, 2).image);
  Compared out;
  out.level = coarse_scene.level;
  out.opacity = at_level[3] / whole[3];
  const double brightest = std::max({whole[0], whole[1], whole[2]});
  for (std::size_t c = 0; c < 3; ++c) {
    out.color = std::max(out.color, std::abs(at_level[c] - whole[c]) / brightest);
  }
  return out;
}

// Views with their defaults at 96 x 72 pixels, where most members of the family are merged.
// The front, thinner than a merged cell, differs most (3.5 %), the others by at most 2 %.
TEST(Level, KeepsMeanOpacityAndColorOfLinesAndMedia) {
  std::map<Shown, int> merged;
  for (const TrialField& field : trial_fields()) {
    const auto dataset = trial_dataset(field);
    for (const Shown shown : {Shown::lines, Shown::medium, Shown::both}) {
      const Compared found = compare(field, shown, *dataset);
      EXPECT_NEAR(found.opacity, 1, 0.04) << field.name << ' ' << static_cast<int>(shown);
      EXPECT_LT(found.color, 0.04) << field.name << ' ' << static_cast<int>(shown);
      merged[shown] += found.level != std::array<int, 3>{0, 0, 0} ? 1 : 0;
    }
  }
  for (const Shown shown : {Shown::lines, Shown::medium, Shown::both}) EXPECT_GE(merged[shown], 4);
}

// The estimated work of a view over that which its frame reports, both in the units of frame::Cost.
double estimate_over_count(const scene::CompletedView& completed, data::Dataset& dataset,
                           bool merged) {
  const auto outline = scene::outline(completed.view(), dataset).value();
  const auto scene = scene::build_scene(completed, dataset).value();
  EXPECT_EQ(scene.level != (std::array{0, 0, 0}), merged);
  const engine::WorkReport work = render(scene, 2).work;
  const double values = merged && !scene.scalars.empty() ? 2 : 1;
  const double pixels = 28 * 21 + static_cast<double>(work.pixel_updates);
  const double counted =
      values * static_cast<double>(work.samples) + pixels / frame::Cost::pixels_a_kernel;
  return frame::cost_of(outline, dataset).kernels / counted;
}

// Lines that end at the boxes of their kernels; a medium without gaps.
TEST(Level, CostEstimateFollowsTheWorkOfAFrame) {
  const TrialField field{"turbulence", {48, 48, 48}, {1e3, 1e3, 1e3}};
  const auto dataset = trial_dataset(field);
  for (const Shown shown : {Shown::lines, Shown::medium}) {
    protocol::View view = small_view(field, shown);
    view.image.width = 28;
    view.image.height = 21;
    view.method.name = protocol::MethodName::kernel;
    view.vector.length = 10;
    view.vector.span = 16;
    view.vector.opacity = 0.05;
    if (shown == Shown::medium) view.scalars->back().extinction.emplace(1, std::array{0.0, 1.0});
    const auto level = scene::complete(view, *dataset).value();
    const auto full =
        level.with([](protocol::View& all) { all.method.detail = protocol::Detail::full; });
    const double at_level = estimate_over_count(level, *dataset, true);
    EXPECT_NEAR(at_level / estimate_over_count(full.value(), *dataset, false), 1, 0.25);
  }
}

// The lines of a level are some of those of full detail, unchanged but for their opacity.
TEST(Level, DrawsASubsetOfTheLines) {
  const TrialField field{"turbulence", {25, 21, 18}, {1e3, 1e3, 1e3}};
  const auto dataset = trial_dataset(field);
  const auto completed = scene::complete(small_view(field, Shown::lines), *dataset);
  const auto coarser = scene::build_scene(completed->coarsened(1), *dataset);
  auto full = scene::build_scene(*completed, *dataset);
  ASSERT_TRUE(coarser) << coarser.error().message;
  ASSERT_EQ(full->level, (std::array{0, 0, 0}));
  ASSERT_NE(coarser->level, full->level);
  auto level = *coarser;
  const double opacity = full->vector->opacity;
  const double r1 = full->vector->r1;
  const double r2 = full->vector->r2;
  level.vector->opacity = opacity;
  level.vector->r1 = r1;
  level.vector->r2 = r2;
  const auto some = render(level, 2).image;
  const auto all = render(*full, 2).image;
  double sum = 0;
  for (std::size_t i = 3; i < all.rgba.size(); i += 4) {
    EXPECT_LE(some.rgba[i], all.rgba[i] + 1e-4F);
    sum += some.rgba[i];
  }
  EXPECT_GT(sum, 10);
}

// The same with a stride, of a group with one, some or none of the lines, up to a group for the
// whole of an axis.
TEST(Level, DrawsASubsetOfTheLinesWithAStride) {
  const TrialField field{"turbulence", {53, 38, 27}, {1e3, 1e3, 1e3}};
  const auto dataset = trial_dataset(field);
  for (const int stride : {2, 3, 5, 8, 13}) {
    protocol::View view = small_view(field, Shown::both);
    view.vector.stride = stride;
    view.vector.min_magnitude = 0;
    const auto completed = scene::complete(view, *dataset);
    auto full = scene::build_scene(*completed, *dataset);
    ASSERT_TRUE(full) << full.error().message;
    full->scalars.clear();
    const auto all = render(*full, 2).image;
    for (const int coarser : {1, 2, 3, 5}) {
      auto level = scene::build_scene(completed->coarsened(coarser), *dataset);
      ASSERT_TRUE(level) << level.error().message;
      level->scalars.clear();
      level->vector->opacity = full->vector->opacity;
      level->vector->r1 = full->vector->r1;
      level->vector->r2 = full->vector->r2;
      const auto some = render(*level, 2).image;
      double sum = 0;
      double beyond = 0;
      for (std::size_t i = 3; i < all.rgba.size(); i += 4) {
        beyond = std::max(beyond, static_cast<double>(some.rgba[i] - all.rgba[i]));
        sum += some.rgba[i];
      }
      EXPECT_GT(sum, 0) << stride << ' ' << coarser;
      EXPECT_LT(beyond, 2e-3) << stride << ' ' << coarser;
    }
  }
}

// At a level no wider than their stride, lines are those of full detail: of the same samples, in
// the same places, as long and as opaque. Pictures differ by rounding alone, and of method kernel
// by the order of lines whose kernels are close to each other; the medium, which lets the level be
// chosen, is left out of both.
TEST(Level, KeepsLinesWithAStrideAsTheyAre) {
  const TrialField field{"turbulence", {29, 22, 18}, {1e3, 1e3, 1e3}};
  const auto dataset = trial_dataset(field);
  for (const int stride : {2, 3, 4, 7}) {
    for (const double span : {1.0, 7.0}) {
      protocol::View view = small_view(field, Shown::both);
      view.image.width = 160;
      view.image.height = 120;
      view.vector.stride = stride;
      view.vector.span = span;
      const auto completed = scene::complete(view, *dataset);
      auto coarser = scene::build_scene(completed->coarsened(stride >= 4 ? 2 : 1), *dataset);
      auto full = scene::build_scene(*completed, *dataset);
      ASSERT_TRUE(coarser) << coarser.error().message;
      ASSERT_EQ(full->level, (std::array{0, 0, 0}));
      ASSERT_GT(*std::max_element(coarser->level.begin(), coarser->level.end()), 0);
      coarser->scalars.clear();
      full->scalars.clear();
      for (const scene::Method method : {scene::Method::kernel, scene::Method::slab}) {
        coarser->method = full->method = method;
        const auto level = render(*coarser, 2).image;
        const auto whole = render(*full, 2).image;
        double most = 0;
        double sum = 0;
        for (std::size_t i = 0; i < whole.rgba.size(); ++i) {
          most = std::max(most, static_cast<double>(std::abs(level.rgba[i] - whole.rgba[i])));
          sum += whole.rgba[i];
        }
        EXPECT_GT(sum, 30) << stride;
        EXPECT_LT(most, method == scene::Method::slab ? 2e-3 : 0.04) << stride << ' ' << span;
      }
    }
  }
}

}  // namespace
}  // namespace windsplat::test
