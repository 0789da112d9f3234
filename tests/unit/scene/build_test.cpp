// From a completed view to the input of the engine: only shown fields are loaded; radii, tables,
// rates, presets, and the description of a dataset.
#include "server/scene/build.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "server/scene/colormap.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/describe.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/presets.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::FieldChoice;
using protocol::View;

std::unique_ptr<data::Dataset> weather(std::shared_ptr<FakeSource::Reads> reads = nullptr,
                                       const std::string& vertical_unit = "m s-1") {
  return dataset_of(std::make_unique<FakeSource>(
      atmosphere_grid(),
      std::vector<data::FieldInfo>{wind_info(vertical_unit), scalar_info("cloud", "1"),
                                   scalar_info("temperature", "K")},
      3, std::move(reads)));
}

TEST(BuildScene, LoadsOnlyWhatIsShown) {
  using Reads = FakeSource::Reads;
  auto reads = std::make_shared<Reads>();
  auto dataset = weather(reads);
  View view;
  view.step = 2;
  Scene scene = built(view, *dataset);
  EXPECT_TRUE(scene.vector);
  EXPECT_EQ(scene.scalars.size(), 1U);
  // Ranges are taken from step 0, the picture shows step 2; the temperature is not used.
  EXPECT_EQ(*reads, (Reads{{"wind@0", 1}, {"wind@2", 1}, {"cloud@0", 1}, {"cloud@2", 1}}));

  reads = std::make_shared<Reads>();
  dataset = weather(reads);
  view = View{};
  view.vector.field = {FieldChoice::Kind::none, ""};
  scene = built(view, *dataset);
  EXPECT_FALSE(scene.vector);
  EXPECT_EQ(*reads, (Reads{{"cloud@0", 1}}));
  EXPECT_EQ(dataset->loads(), 1U);

  reads = std::make_shared<Reads>();
  dataset = weather(reads);
  view = View{};
  view.scalars.emplace();
  scene = built(view, *dataset);
  EXPECT_TRUE(scene.scalars.empty());
  EXPECT_EQ(*reads, (Reads{{"wind@0", 1}}));
}

TEST(BuildScene, AnEmptyOpacityFunctionIsNoMedium) {
  auto reads = std::make_shared<FakeSource::Reads>();
  auto dataset = weather(reads);
  View view;
  view.vector.field = {FieldChoice::Kind::none, ""};
  protocol::ScalarView scalar;
  scalar.field = "cloud";
  scalar.color.range = protocol::Range{0, 1};
  scalar.extinction = {{0, 0}, {1, 0}};
  view.scalars = {scalar};
  EXPECT_TRUE(built(view, *dataset).scalars.empty());
  EXPECT_TRUE(reads->empty());
}

TEST(BuildScene, ShowsTheRequestedStep) {
  auto dataset = weather();
  View view;
  view.step = 1;
  const Scene scene = built(view, *dataset);
  EXPECT_EQ(scene.vector->field->component(0)[0], 1000.0F);
  EXPECT_EQ(scene.scalars[0].field->component(0)[5], 1005.0F);
}

TEST(BuildScene, RadiiScaleWithThePictureHeight) {
  auto dataset = weather();
  View view;
  view.image.height = 1440;
  Scene scene = built(view, *dataset);
  EXPECT_NEAR(scene.vector->r1, 1.2, 1e-12);
  EXPECT_NEAR(scene.vector->r2, 2.8, 1e-12);
  EXPECT_NEAR(scene.vector->opacity, 0.8, 1e-12);
  // At a quarter of the height r1 = 0.15, r2 = 0.35: half width 0.25, so r1 = 0, r2 = 1 and half
  // the opacity.
  view.image.height = 180;
  scene = built(view, *dataset);
  EXPECT_NEAR(scene.vector->r1, 0.0, 1e-12);
  EXPECT_NEAR(scene.vector->r2, 1.0, 1e-12);
  EXPECT_NEAR(scene.vector->opacity, 0.8 * 0.5, 1e-12);
  // Just below one pixel: r1 = 0.9, r2 = 0.99 keeps its opacity, half width 0.945.
  view.image.height = 720;
  view.vector.r1 = 0.9;
  view.vector.r2 = 0.99;
  scene = built(view, *dataset);
  EXPECT_NEAR(scene.vector->r1, 0.445, 1e-12);
  EXPECT_NEAR(scene.vector->r2, 1.445, 1e-12);
  EXPECT_NEAR(scene.vector->opacity, 0.8, 1e-12);
}

TEST(BuildScene, MarksScaleWithThePictureHeight) {
  auto dataset = weather();
  View view;
  view.image.height = 1440;
  view.vector.mark = {protocol::MarkShape::arrow, 7, 10, 0.25, 1.5};
  const LineMark arrow = built(view, *dataset).vector->mark;
  EXPECT_EQ(arrow.shape, LineShape::arrow);
  EXPECT_NEAR(arrow.head_width, 14, 1e-12);
  EXPECT_NEAR(arrow.head_length, 20, 1e-12);
  EXPECT_NEAR(arrow.halo, 3, 1e-12);
  EXPECT_NEAR(arrow.tail_light, 0.75, 1e-12);
}

// Whitening changes the hue; the other shapes keep the light of their tails unless asked.
TEST(BuildScene, CometsHaveDarkTailsInsteadOfWhiteHeads) {
  auto dataset = weather();
  View view;
  EXPECT_EQ(built(view, *dataset).vector->mark.tail_light, 1);
  EXPECT_NEAR(built(view, *dataset).vector->head_desaturation, 0.7, 1e-12);
  view.vector.mark.shape = protocol::MarkShape::comet;
  const Scene comets = built(view, *dataset);
  EXPECT_NEAR(comets.vector->mark.tail_light, 0.15, 1e-12);
  EXPECT_EQ(comets.vector->head_desaturation, 0);
  view.vector.mark.tail_darkening = 0.4;
  EXPECT_NEAR(built(view, *dataset).vector->mark.tail_light, 0.6, 1e-12);
}

// Part that heads are whitened and tails darkened.
std::array<double, 2> heads_and_tails(data::Dataset& dataset,
                                      const std::function<void(View&)>& change) {
  View view;
  change(view);
  const auto completed = complete(view, dataset);
  EXPECT_TRUE(completed);
  const protocol::VectorView& lines = completed->view().vector;
  return {lines.head_desaturation.value(), lines.mark.tail_darkening.value()};
}

TEST(BuildScene, PlainLinesHaveDarkTailsInColorsThatWhiteningHardlyChanges) {
  auto dataset = weather();
  constexpr std::array<double, 2> white_heads{0.7, 0};
  constexpr std::array<double, 2> dark_tails{0, 0.85};
  for (const char* map :
       {"viridis", "magma", "inferno", "plasma", "ice", "sunset", "compass", "coolwarm"}) {
    EXPECT_EQ(heads_and_tails(*dataset, [&](View& v) { v.vector.color.map = map; }), white_heads)
        << map;
  }
  for (const char* map : {"cividis", "clouds", "tealrose", "moss", "grays"}) {
    const auto told = [&](const auto& change) {
      return heads_and_tails(*dataset, [&](View& view) {
        view.vector.color.map = map;
        change(view);
      });
    };
    EXPECT_EQ(told([](View&) {}), dark_tails) << map;
    // White heads vanish in a white background, and dark tails do not.
    EXPECT_EQ(told([](View& v) { v.image.background = "#ffffff"; }), white_heads) << map;
    // Other shapes tell their heads themselves; streamlets have no marks.
    EXPECT_EQ(told([](View& v) { v.vector.mark.shape = protocol::MarkShape::taper; }), white_heads);
    EXPECT_EQ(told([](View& v) { v.vector.trace.emplace(); }), white_heads);
    // What is given stays.
    EXPECT_EQ(told([](View& v) { v.vector.head_desaturation = 0.7; }), white_heads);
    EXPECT_EQ(told([](View& v) { v.vector.mark.tail_darkening = 0; }), white_heads);
  }
  const auto of_one_color = [&](const char* color) {
    return heads_and_tails(*dataset, [&](View& view) {
      view.vector.color.by = protocol::ColorBy::constant;
      view.vector.color.constant = color;
    });
  };
  EXPECT_EQ(of_one_color("#ffffff"), dark_tails);
  EXPECT_EQ(of_one_color("#2040c0"), white_heads);
}

TEST(BuildScene, ReversedColorRangesReverseTheMap) {
  auto dataset = weather();
  View view;
  protocol::ScalarView scalar;
  scalar.field = "cloud";
  scalar.color.map = "viridis";
  scalar.color.range = protocol::Range{10, -5};
  view.scalars = {scalar};
  const Scene scene = built(view, *dataset);
  const ColorTable& table = scene.scalars[0].color;
  EXPECT_EQ(table.range, (std::array<double, 2>{-5, 10}));
  ASSERT_EQ(table.entries.size(), 256U);
  EXPECT_EQ(table.entries.front(), color_map_linear("viridis", 256).back());
}

TEST(BuildScene, ConstantColorAndBackgroundAreLinear) {
  auto dataset = weather();
  View view;
  view.vector.color.by = protocol::ColorBy::constant;
  view.vector.color.constant = "#ff0000";
  view.image.background = "#ffffff";
  const Scene scene = built(view, *dataset);
  EXPECT_EQ(scene.vector->color_by, LineColor::constant);
  for (const std::size_t n : {std::size_t{0}, std::size_t{255}}) {
    EXPECT_EQ(scene.vector->color.entries.at(n), (std::array<float, 3>{1, 0, 0}));
  }
  EXPECT_EQ(scene.background, (std::array<float, 3>{1, 1, 1}));
}

TEST(BuildScene, EpochFollowsTheStepOnlyWhenAsked) {
  auto dataset = weather();
  View view;
  view.step = 2;
  EXPECT_EQ(built(view, *dataset).vector->epoch, 0U);
  view.vector.jitter.per_step = true;
  EXPECT_EQ(built(view, *dataset).vector->epoch, 2U);
}

constexpr double metres_per_degree = 6371000.0 * std::numbers::pi / 180.0;

TEST(WorldRates, MeridiansConvergeAndPressureFallsAsAirRises) {
  auto dataset = weather();
  View view;
  view.vector.space = protocol::VectorSpace::world;
  const Scene scene = built(view, *dataset);
  const VectorLayer& layer = *scene.vector;
  // 40 degrees are 2 world units.
  const double per_degree = 2.0 / 40.0;
  EXPECT_NEAR(layer.rate_x[1], per_degree / metres_per_degree, 1e-15);
  EXPECT_NEAR(layer.rate_x[0] / layer.rate_x[1], 1.0 / std::cos(10.0 * std::numbers::pi / 180.0),
              1e-12);
  EXPECT_NEAR(layer.rate_y, per_degree / metres_per_degree, 1e-15);
  // A scale height of 7400 m is one e-fold of pressure; 0.1 of the world is one factor of 2.
  for (const double rate : layer.rate_z) {
    EXPECT_NEAR(rate, 0.1 / std::log(2.0) / 7400.0, 1e-15);
  }
}

TEST(WorldRates, OmegaRisesWherePressureFalls) {
  for (const char* unit : {"Pa s-1", "Pa/s", "Pa s**-1"}) {
    auto dataset = weather(nullptr, unit);
    View view;
    view.vector.space = protocol::VectorSpace::world;
    const Scene scene = built(view, *dataset);
    // d(world z)/dt = -(0.1 / ln 2) omega / p: at 1000 hPa and at 250 hPa.
    EXPECT_NEAR(scene.vector->rate_z[0], -0.1 / std::log(2.0) / 100000.0, 1e-15) << unit;
    EXPECT_NEAR(scene.vector->rate_z[2], -0.1 / std::log(2.0) / 25000.0, 1e-15) << unit;
  }
}

// Low pressure is at the top of the picture, whichever attribute gives the direction.
TEST(BuildScene, ComponentsPointUpWhereAirRises) {
  View view;
  view.vector.scale = {1, 2, 3};
  for (const auto& [unit, sign] :
       {std::pair("m s-1", 1), {"Pa s-1", -1}, {"Pa/s", -1}, {"hPa/sec", -1}}) {
    auto dataset = weather(nullptr, unit);
    const Scene scene = built(view, *dataset);
    EXPECT_EQ(scene.vector->scale, glm::dvec3(1, 2, 3.0 * sign)) << unit;
    EXPECT_TRUE(scene.vector->rate_z.empty());
  }
}

// Level 1 may be the highest or the lowest, so omega is used unchanged.
TEST(BuildScene, OmegaOnNumberedLevelsIsNotTurned) {
  data::Grid grid = atmosphere_grid();
  grid.axes[2] = axis(data::AxisKind::level, "", {1, 2, 3});
  data::FieldInfo wind = wind_info();
  wind.component_units = {"m s-1", "m s-1", "Pa s-1"};
  auto dataset = dataset_of(
      std::make_unique<FakeSource>(std::move(grid), std::vector<data::FieldInfo>{wind}, 1));
  EXPECT_EQ(built(View{}, *dataset).vector->scale, glm::dvec3(1, 1, 1));
}

// The lowest level of the shell is half a cell above the inside, which the body nearly fills.
TEST(BuildScene, AGlobeHasABodyUnlessItIsOff) {
  using protocol::GroundShow;
  auto dataset = weather();
  View view;
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  view.ground.surface_color = "#00ff00";
  const Scene scene = built(view, *dataset);
  ASSERT_TRUE(scene.body);
  EXPECT_EQ(scene.body->shape, BodyShape::sphere);
  EXPECT_EQ(scene.body->color, (std::array<float, 3>{0, 1, 0}));
  const auto& lowest = scene.lattice.places->front();
  const double level = std::hypot(lowest[0], lowest[1], lowest[2]);
  const double inside = level - 0.5 * scene.lattice.spacing[2].front();
  EXPECT_LT(scene.body->radius, inside);
  EXPECT_GT(scene.body->radius, 0.998 * inside);
  view.ground.show = GroundShow::on;
  EXPECT_TRUE(built(view, *dataset).body);
  view.ground.show = GroundShow::off;
  EXPECT_FALSE(built(view, *dataset).body);
}

TEST(BuildScene, OtherMappingsHaveAGroundIfItIsOn) {
  auto dataset = weather();
  View view;
  view.ground.show = protocol::GroundShow::on;
  const Scene scene = built(view, *dataset);
  ASSERT_TRUE(scene.body);
  EXPECT_EQ(scene.body->shape, BodyShape::ground);
  EXPECT_EQ(scene.body->height, scene.lattice.box_min.z);
  EXPECT_EQ(scene.body->low, glm::dvec2(scene.lattice.box_min));
  EXPECT_EQ(scene.body->high, glm::dvec2(scene.lattice.box_max));
}

TEST(BuildScene, TheColorOfTheBodyIsChecked) {
  auto dataset = weather();
  View view;
  view.ground.surface_color = "green";
  const auto refused = complete(view, *dataset);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().at.at(0).pointer, "/ground/surfaceColor");
}

TEST(WorldRates, HeightAxesUseMetersPerSecondUnchanged) {
  data::Grid grid = atmosphere_grid();
  grid.axes[0] = axis(data::AxisKind::cartesian, "km", {0, 1, 2, 3});
  grid.axes[1] = axis(data::AxisKind::cartesian, "km", {0, 1, 2});
  grid.axes[2] = axis(data::AxisKind::height, "m", {0, 1000, 2000});
  auto dataset = dataset_of(
      std::make_unique<FakeSource>(std::move(grid), std::vector<data::FieldInfo>{wind_info()}, 1));
  View view;
  view.vector.space = protocol::VectorSpace::world;
  const Scene scene = built(view, *dataset);
  EXPECT_NEAR(scene.vector->rate_x[0], 0.5 / 1000.0, 1e-12);
  EXPECT_NEAR(scene.vector->rate_y, 0.5 / 1000.0, 1e-12);
  EXPECT_NEAR(scene.vector->rate_z[1], 0.5 / 1000.0, 1e-12);
}

TEST(WorldRates, AreAbsentForComponentsAndRefusedForUnknownUnits) {
  auto dataset = weather();
  EXPECT_TRUE(built(View{}, *dataset).vector->rate_x.empty());
  data::Grid grid = atmosphere_grid();
  grid.axes[2] = axis(data::AxisKind::level, "", {0, 1, 2});
  dataset = dataset_of(
      std::make_unique<FakeSource>(std::move(grid), std::vector<data::FieldInfo>{wind_info()}, 1));
  View view;
  view.vector.space = protocol::VectorSpace::world;
  const auto refused = build_scene(*complete(view, *dataset), *dataset);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  EXPECT_EQ(refused.error().at.at(0).pointer, "/vector/space");
}

TEST(Presets, ChangeTheNamedProperties) {
  auto dataset = weather();
  const Lattice lattice = *place_lattice(dataset->info().grid, {});
  const View start = complete({}, *dataset)->view();
  EXPECT_THAT(preset_names(),
              testing::ElementsAre("default", "winds", "clouds", "top", "south", "figure"));
  for (const std::string& name : preset_names()) {
    View view = start;
    ASSERT_TRUE(apply_preset(view, lattice, name)) << name;
    EXPECT_TRUE(build_scene(view, *dataset)) << name;
  }
  View view = start;
  ASSERT_TRUE(apply_preset(view, lattice, "winds"));
  EXPECT_TRUE(view.scalars->empty());
  view = start;
  ASSERT_TRUE(apply_preset(view, lattice, "clouds"));
  EXPECT_EQ(view.vector.field.kind, FieldChoice::Kind::none);
  EXPECT_FALSE(view.scalars->empty());
  ASSERT_TRUE(apply_preset(view, lattice, "top"));
  EXPECT_NEAR((*view.camera.eye)[0], 0, 1e-9);
  EXPECT_NEAR((*view.camera.eye)[1], 0, 1e-9);
  EXPECT_GT((*view.camera.eye)[2], 1);
  ASSERT_TRUE(apply_preset(view, lattice, "default"));
  EXPECT_EQ(view.camera.eye, start.camera.eye);
  view = start;
  ASSERT_TRUE(apply_preset(view, lattice, "figure"));
  EXPECT_TRUE(view.annotations.legend && view.annotations.axes && view.annotations.step_time);
  EXPECT_TRUE(view.vector.color.true_colors);
  EXPECT_EQ(view.vector.mark.tail_darkening, 0.85);
  View with_texts;
  with_texts.annotations = view.annotations;
  EXPECT_EQ(view.camera, complete(with_texts, *dataset)->view().camera);
  const auto refused = apply_preset(view, lattice, "sideways");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().at.at(0).pointer, "/preset");
}

TEST(Describe, DerivedFieldsAreListedButNeitherReadNorShownNorCounted) {
  auto reads = std::make_shared<FakeSource::Reads>();
  auto vorticity = scalar_info("wind_vertical_vorticity", "s-1");
  vorticity.derived = true;
  auto dataset = dataset_of(std::make_unique<FakeSource>(
      atmosphere_grid(),
      std::vector<data::FieldInfo>{wind_info(), scalar_info("temperature", "K"), vorticity}, 1,
      reads));
  const auto told = *describe(*dataset, RangesOf::all_steps);
  ASSERT_EQ(told.fields.size(), 3U);
  EXPECT_FALSE(told.fields[2].range);
  EXPECT_EQ(reads->count("wind_vertical_vorticity@0"), 0U);
  EXPECT_EQ(told.default_view.scalars->size(), 0U);
  EXPECT_EQ(told.bytes_when_resident, 4U * 36U * 4U);
}

TEST(Describe, LoadsNothingUnlessRangesAreRequested) {
  auto dataset = weather();
  const auto brief = *describe(*dataset, RangesOf::none);
  EXPECT_EQ(dataset->loads(), 0U);
  EXPECT_EQ(brief.id, "fake");
  EXPECT_EQ(brief.state, "ready");
  EXPECT_EQ(brief.dims, (std::array<int, 3>{4, 3, 3}));
  EXPECT_FALSE(brief.fields[0].range);
  EXPECT_EQ(brief.axes[2].kind, "pressure");
  EXPECT_EQ(brief.axes[2].coordinates[1], 500);
  EXPECT_NEAR(brief.axes[2].world[2], 0.1, 1e-12);
  EXPECT_NEAR(brief.world_max[0], 1.0, 1e-12);
  EXPECT_NEAR(brief.world_min[2], -0.15, 1e-12);
  EXPECT_EQ(brief.steps.size(), 3U);
  // (3 + 1 + 1) components of 36 samples of 4 bytes at 3 steps.
  EXPECT_EQ(brief.bytes_when_resident, 5U * 36U * 4U * 3U);
}

TEST(Describe, RangesCoverTheFirstStepOrAll) {
  auto dataset = weather();
  const auto first = *describe(*dataset, RangesOf::first_step);
  EXPECT_EQ(first.fields[1].range, (protocol::Range{0, 35}));
  EXPECT_EQ(first.fields[1].range_of, "step");
  EXPECT_EQ(first.fields[1].masked, 0);
  EXPECT_EQ(first.default_view.vector.field.name, "wind");
  ASSERT_TRUE(first.default_view.camera.eye);
  const auto all = *describe(*dataset, RangesOf::all_steps);
  EXPECT_EQ(all.fields[1].range, (protocol::Range{0, 2035}));
  EXPECT_EQ(all.fields[1].range_of, "all");
}

TEST(Describe, FullyMaskedFieldHasNoRange) {
  auto source = std::make_unique<FakeSource>(
      atmosphere_grid(), std::vector<data::FieldInfo>{scalar_info("cloud", "1")}, 2);
  source->constant = std::make_unique<double>(std::nan(""));
  auto dataset = dataset_of(std::move(source));
  const auto all = *describe(*dataset, RangesOf::all_steps);
  EXPECT_FALSE(all.fields[0].range);
  EXPECT_EQ(all.fields[0].masked, 72);
}

}  // namespace
}  // namespace windsplat::scene
