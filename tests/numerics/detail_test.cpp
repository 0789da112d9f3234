// Pictures at a coarser level compared with pictures at full detail.
#include "server/scene/detail.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "scenes.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/engine/kernels/dispatch.hpp"
#include "server/engine/reference/reference.hpp"
#include "tests/numerics/naive_renderer.hpp"

namespace windsplat::test {
namespace {

using Level = std::array<int, 3>;

// A cube of 128 samples per side, as wide as a picture of 64 pixels: half a pixel per cell.
scene::Scene small_picture() {
  scene::Scene scene;
  const double cell = 2.0 / 128;
  scene.lattice = even_lattice({128, 128, 128}, {cell, cell, cell});
  scene.camera = look({0, 0, 0}, {0.35, 1, -0.4}, 5, 64, 64, false, 1.0);
  scene.stop_transmittance = 0;
  return scene;
}

std::shared_ptr<const data::Volume> coarser(const std::shared_ptr<const data::Volume>& fine,
                                            const data::Coarsening& how) {
  return std::make_shared<const data::Volume>(data::coarsen(*fine, how));
}

scene::Scene at_level(const scene::Scene& full, const Level& level) {
  scene::Scene scene = full;
  const auto how = scene::coarsening_of(full.lattice, level);
  scene.lattice = scene::coarsen_lattice(full.lattice, level);
  scene.level = level;
  for (auto& layer : scene.scalars) layer.field = coarser(layer.field, how);
  if (scene.vector) {
    data::Coarsening drawn = how;
    drawn.reduction = data::Reduction::drawn;
    drawn.stride = scene.vector->stride;
    scene.vector->field = coarser(scene.vector->field, drawn);
    scene::merge_lines(full.lattice, level, scene::pixels_per_unit(full.camera, full.lattice),
                       *scene.vector);
  }
  return scene;
}

double rmse(const engine::Image& a, const engine::Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    const double d = static_cast<double>(a.rgba[i]) - b.rgba[i];
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(a.rgba.size()));
}

double mean_alpha(const engine::Image& image) {
  double sum = 0;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) sum += image.rgba[i];
  return 4 * sum / static_cast<double>(image.rgba.size());
}

TEST(Detail, SmoothBlobLooksTheSameAtAnEighthOfItsSamples) {
  scene::Scene full = small_picture();
  const auto blob = [](int, double x, double y, double z) {
    return static_cast<float>(4 * std::exp(-6 * (x * x + y * y + z * z)));
  };
  full.scalars = {medium(make_volume(full.lattice, 1, blob), {0.9F, 0.5F, 0.2F})};
  full.scalars[0].color = ramp_color(0, 4, {0.9F, 0.2F, 0.1F}, {0.2F, 0.5F, 1.0F});
  const Level level{1, 1, 1};
  for (const auto method : {scene::Method::kernel, scene::Method::slab}) {
    full.method = method;
    const engine::Rendered whole = render(full);
    ASSERT_GT(mean_alpha(whole.image), 0.1);
    const engine::Rendered coarse = render(at_level(full, level));
    EXPECT_EQ(8 * coarse.work.samples, whole.work.samples);
    const double error = rmse(whole.image, coarse.image);
    EXPECT_LT(error, 2e-3);
    // Two additional levels exceed the bound, so the check above can fail.
    EXPECT_GT(rmse(whole.image, render(at_level(full, {3, 3, 3})).image), 3 * error);
  }
}

// Extinction is per length, so that merging preserves the transmitted light. White noise is the
// worst case of a box filter.
TEST(Detail, NoiseKeepsItsMeanOpacity) {
  scene::Scene full = small_picture();
  std::mt19937 random(5);
  std::uniform_real_distribution<float> value(0, 1);
  full.scalars = {medium(
      make_volume(full.lattice, 1, [&](int, double, double, double) { return value(random); }),
      {1, 1, 1})};
  const double whole = mean_alpha(render(full).image);
  const double coarse = mean_alpha(render(at_level(full, {1, 1, 1})).image);
  EXPECT_NEAR(coarse, whole, 0.005 * whole);
}

TEST(Detail, SliceOfAMediumKeepsItsMeanOpacity) {
  scene::Scene full = small_picture();
  full.lattice = even_lattice({65, 63, 3}, {2.0 / 65, 2.0 / 63, 0.05});
  full.slice = scene::Slice{2, 1};
  std::mt19937 random(5);
  std::uniform_real_distribution<float> value(0, 8);
  full.scalars = {medium(
      make_volume(full.lattice, 1, [&](int, double, double, double) { return value(random); }),
      {1, 1, 1})};
  for (const auto method : {scene::Method::kernel, scene::Method::slab}) {
    full.method = method;
    const double whole = mean_alpha(render(full).image);
    ASSERT_GT(whole, 0.01);
    EXPECT_NEAR(mean_alpha(render(at_level(full, {1, 1, 0})).image), whole, 0.02 * whole);
  }
}

TEST(Detail, SmallLinesKeepTheirMeanOpacity) {
  for (const double opacity : {0.002, 0.02, 0.2}) {
    scene::Scene full = small_picture();
    // Every sample has a line of a few pixels whose direction varies slowly.
    const auto swirl = [](int c, double x, double y, double z) {
      const std::array<double, 3> v{-y, x, 0.5 * std::cos(2 * z)};
      const double length = std::sqrt(x * x + y * y + 0.25 * std::cos(2 * z) * std::cos(2 * z));
      return static_cast<float>(v.at(static_cast<std::size_t>(c)) / length);
    };
    full.vector = plain_lines(make_volume(full.lattice, 3, swirl), {1, 1, 1});
    full.vector->length = 0.1;
    full.vector->r1 = 0;
    full.vector->r2 = 1;
    full.vector->opacity = opacity;
    const double whole = mean_alpha(render(full).image);
    ASSERT_GT(whole, 0.1) << opacity;
    EXPECT_NEAR(mean_alpha(render(at_level(full, {1, 1, 1})).image), whole, 0.04 * whole)
        << opacity;
    EXPECT_NEAR(mean_alpha(render(at_level(full, {1, 0, 1})).image), whole, 0.04 * whole)
        << opacity;
  }
}

// Layers that become wider, as those of an atmosphere: lines keep the place and the box that they
// have at full detail, also along an axis that is not halved.
TEST(Detail, LinesWithAStrideAlongUnevenAxesAreThoseOfFullDetail) {
  scene::Scene full;
  std::array<std::vector<double>, 3> spacing;
  for (int n = 0; n < 23; ++n) spacing[0].push_back(0.05 * (1 + 0.4 * std::sin(n)));
  for (int n = 0; n < 20; ++n) spacing[1].push_back(0.05);
  for (int n = 0; n < 17; ++n) spacing[2].push_back(0.01 * std::pow(1.2, n));
  full.lattice = make_lattice(spacing);
  full.camera = look({0, 0, 0}, {0.35, 1, -0.4}, 5, 160, 120, true, 0.3);
  full.stop_transmittance = 0;
  full.method = scene::Method::slab;
  const auto swirl = [](int c, double x, double y, double z) {
    return static_cast<float>(
        std::array{-y, x, 0.3 * std::cos(5 * z)}.at(static_cast<std::size_t>(c)));
  };
  full.vector = plain_lines(make_volume(full.lattice, 3, swirl), {1, 1, 1});
  full.vector->length = 0.3;
  full.vector->jitter_center = 0.6;
  full.vector->jitter_stride = 0.5;
  for (const int stride : {2, 3, 5}) {
    for (const double span : {1.0, 5.0}) {
      full.vector->stride = stride;
      full.vector->span = span;
      const engine::Rendered whole = render(full);
      EXPECT_GT(mean_alpha(whole.image), 0.002);
      for (const Level& level : {Level{1, 1, 0}, Level{1, 1, 1}, Level{0, 1, 1}}) {
        EXPECT_LT(largest_difference(render(at_level(full, level)), whole), 2e-3) << stride << span;
      }
    }
  }
}

// A thin layer of opaque lines with gaps: merged lines must not transmit more light.
TEST(Detail, OpaqueLinesInOneLayerKeepTheirMeanOpacity) {
  scene::Scene full = small_picture();
  const auto few = [](int c, double x, double y, double z) {
    const bool there = std::abs(z) < 0.03 && std::sin(25 * x) * std::sin(25 * y) > 0.5;
    return c == 0 && there ? 1.0F : 0.0F;
  };
  full.vector = plain_lines(make_volume(full.lattice, 3, few), {1, 1, 1});
  full.vector->length = 0.1;
  full.vector->opacity = 1;
  full.vector->min_magnitude = 0.4;
  for (const double r1 : {0.0, 0.6}) {
    full.vector->r1 = r1;
    full.vector->r2 = r1 + 0.8;
    const double whole = mean_alpha(render(full).image);
    ASSERT_GT(whole, 0.1);
    ASSERT_LT(whole, 0.7);
    EXPECT_NEAR(mean_alpha(render(at_level(full, {1, 1, 1})).image), whole, 0.08 * whole) << r1;
  }
}

// Lines in the last of 33 layers only, whose group at the level has no second layer: about half of
// them are drawn, each for two. Of n the mean deviates by sqrt(n); six times that are allowed.
TEST(Detail, LastLayerOfAnOddExtentKeepsItsMeanOpacity) {
  scene::Scene full = small_picture();
  const int side = 64;
  const double cell = 2.0 / 128;
  full.lattice = even_lattice({side, side, 33}, {2 * cell, 2 * cell, cell});
  const double top = full.lattice.positions[2].back();
  full.vector = plain_lines(make_volume(full.lattice, 3,
                                        [top](int c, double, double, double z) {
                                          return c == 0 && z == top ? 1.0F : 0.0F;
                                        }),
                            {1, 1, 1});
  full.vector->length = 0.1;
  full.vector->opacity = 0.01;
  full.vector->min_magnitude = 0.5;
  const double whole = mean_alpha(render(full).image);
  ASSERT_GT(whole, 0.01);
  ASSERT_LT(whole, 0.2) << "too dense for opacities to add up";
  EXPECT_NEAR(mean_alpha(render(at_level(full, {0, 0, 1})).image) / whole, 1, 6.0 / side);
}

// Extents that are no multiples of a group, uneven rates, boxes that clip the lines.
scene::Scene lines_to_draw(bool perspective) {
  scene::Scene scene;
  scene.lattice = even_lattice({21, 18, 7}, {0.09, 0.1, 0.2});
  scene.camera = look({0, 0, 0}, {0.4, 1, -0.7}, 4, 120, 90, perspective, perspective ? 0.35 : 1.2);
  scene.method = scene::Method::slab;
  scene.stop_transmittance = 0;
  const auto wind = [](int c, double x, double y, double z) {
    return static_cast<float>(std::sin(5 * x + 2 * c) + std::cos(4 * y - c) * std::sin(3 * z + c));
  };
  scene.vector = plain_lines(make_volume(scene.lattice, 3, wind), {1, 1, 1});
  scene.vector->color_by = scene::LineColor::world_z;
  scene.vector->color = ramp_color(-0.7, 0.7, {0.9F, 0.3F, 0.1F}, {0.1F, 0.4F, 0.9F});
  scene.vector->length = 0.4;
  scene.vector->span = 3;
  scene.vector->jitter_center = 0.5;
  scene.vector->jitter_stride = 0.3;
  scene.vector->magnitude_range = {0, 1.5};
  for (int j = 0; j < 18; ++j) scene.vector->rate_x.push_back(j % 2 == 0 ? 0.3 : 2.0);
  for (int k = 0; k < 7; ++k) scene.vector->rate_z.push_back(k % 3 == 0 ? 1.5 : 0.2);
  return scene;
}

// The scene with the samples that a level draws alone, at full detail.
scene::Scene only_drawn(const scene::Scene& full, const Level& level) {
  float next = 0;
  const auto numbers =
      make_volume(full.lattice, 1, [&](int, double, double, double) { return next++; });
  const auto drawn = data::coarsen(*numbers, {level, {}, data::Reduction::drawn});
  const data::Samples& all = full.vector->field->values;
  std::vector<float> kept(all.size(), std::numeric_limits<float>::quiet_NaN());
  const std::size_t samples = full.vector->field->samples();
  for (const float number : drawn.values) {
    if (std::isnan(number)) continue;
    for (std::size_t at = static_cast<std::size_t>(number); at < all.size(); at += samples) {
      kept[at] = all[at];
    }
  }
  auto field = std::make_shared<data::Volume>(*full.vector->field);
  field->values = std::move(kept);
  scene::Scene scene = full;
  scene.vector->field = std::move(field);
  return scene;
}

// The kernels draw the same samples as the reduction of the fields, with their own rates, places,
// jitter and boxes, on every instruction set.
TEST(Detail, LinesAreThoseOfTheirSamplesAtFullDetail) {
  for (const bool sliced : {false, true}) {
    for (const bool perspective : {false, true}) {
      scene::Scene full = lines_to_draw(perspective);
      if (sliced) full.slice = scene::Slice{2, 4};
      const Level level = sliced ? Level{1, 1, 0} : Level{1, 2, 1};
      scene::Scene coarse = at_level(full, level);
      EXPECT_GT(coarse.vector->opacity, full.vector->opacity);
      coarse.vector->opacity = full.vector->opacity;
      coarse.vector->r1 = full.vector->r1;
      coarse.vector->r2 = full.vector->r2;
      const engine::Rendered wanted = render(only_drawn(full, level));
      ASSERT_GT(mean_alpha(wanted.image), 0.01);
      EXPECT_GT(largest_difference(render(full), wanted), 0.1F) << "not all lines are drawn";
      for (const auto* table : engine::kernels::usable_tables()) {
        EXPECT_LT(largest_difference(render_with(*table, coarse), wanted), 1e-3F)
            << table->name << (sliced ? " slice" : "");
      }
    }
  }
}

TEST(Detail, IsRefusedByTheReferencesWhichDrawEverySample) {
  scene::Scene scene = at_level(lines_to_draw(true), {1, 0, 0});
  EXPECT_THROW(naive::render<double>(scene), std::logic_error);
  ThreadPool pool(1);
  EXPECT_THROW((void)engine::reference::render(scene, pool, CancelToken(), {1e-3}),
               std::logic_error);
}

TEST(Detail, IsTheSameForAnyNumberOfThreads) {
  scene::Scene full = small_picture();
  const auto wave = [](int c, double x, double y, double z) {
    return static_cast<float>(1 + std::sin(5 * x + c) * std::cos(4 * y - z));
  };
  full.scalars = {medium(make_volume(full.lattice, 1, wave), {0.9F, 0.5F, 0.2F})};
  full.vector = plain_lines(make_volume(full.lattice, 3, wave), {0.2F, 0.5F, 0.9F});
  const auto one = render(at_level(full, {1, 1, 1}), 1);
  const auto three = render(at_level(full, {1, 1, 1}), 3);
  EXPECT_EQ(one.image.rgba, three.image.rgba);
}

}  // namespace
}  // namespace windsplat::test
