// Slices, colour by direction and by a second field, motion, methods: from the view to the scene.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/scene/completed_view.hpp"
#include "server/scene/defaults.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::ColorBy;
using protocol::GridAxis;
using protocol::SliceView;
using protocol::View;

std::unique_ptr<data::Dataset> known_weather(std::shared_ptr<FakeSource::Reads> reads = nullptr) {
  return dataset_of(std::make_unique<FakeSource>(
      atmosphere_grid(),
      std::vector<data::FieldInfo>{wind_info(), scalar_info("cloud", "1"),
                                   scalar_info("temperature", "K")},
      3, std::move(reads)));
}

std::string pointer_of_refusal(const View& view, data::Dataset& dataset) {
  const auto refused = complete(view, dataset);
  if (refused || refused.error().at.empty()) return "(taken)";
  EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  return refused.error().at[0].pointer;
}

TEST(Slice, IsTheLayerNamedByTheView) {
  auto dataset = known_weather();
  EXPECT_FALSE(built(View{}, *dataset).slice);
  View view;
  view.geometry.slice = SliceView{GridAxis::y, 2};
  const Scene scene = built(view, *dataset);
  ASSERT_TRUE(scene.slice);
  EXPECT_EQ(scene.slice->axis, 1);
  EXPECT_EQ(scene.slice->sample, 2);
}

TEST(Slice, BeyondTheGridIsRefusedWithItsLimit) {
  auto dataset = known_weather();
  const std::array<int, 3> layers{4, 3, 3};
  for (const GridAxis axis : {GridAxis::x, GridAxis::y, GridAxis::z}) {
    const int count = layers.at(static_cast<std::size_t>(axis));
    View view;
    view.geometry.slice = SliceView{axis, count - 1.0};
    EXPECT_TRUE(complete(view, *dataset));
    view.geometry.slice->index = count;
    EXPECT_EQ(pointer_of_refusal(view, *dataset), "/geometry/slice/index");
    EXPECT_THAT(complete(view, *dataset).error().message,
                testing::HasSubstr("0 to " + std::to_string(count - 1)));
  }
}

// A full volume occludes itself unless its lines are few; a slice does not.
TEST(Slice, HasMoreLinesThanTheVolumeAndLeavesFewOut) {
  auto dataset = sample_dataset("climate", {96, 48, 19});
  const View whole = complete({}, *dataset)->view();
  const double top = (*whole.vector.magnitude_range)[1];
  for (const GridAxis axis : {GridAxis::x, GridAxis::y, GridAxis::z}) {
    View view;
    view.geometry.slice = SliceView{axis, 9};
    const auto full = complete(view, *dataset);
    ASSERT_TRUE(full);
    EXPECT_EQ(full->view().vector.magnitude_range, whole.vector.magnitude_range);
    EXPECT_LT(*full->view().vector.stride, *whole.vector.stride) << static_cast<int>(axis);
    EXPECT_LT(*full->view().vector.min_magnitude, 0.25 * top) << static_cast<int>(axis);
  }
}

// The axis across a slice limits its stride as little as other layers hide its lines.
TEST(Slice, CountsItsOwnLinesOnly) {
  data::Grid grid;
  std::vector<double> many(900);
  for (std::size_t n = 0; n < many.size(); ++n) many[n] = static_cast<double>(n);
  grid.axes = {axis(data::AxisKind::cartesian, "m", many),
               axis(data::AxisKind::cartesian, "m", many),
               axis(data::AxisKind::cartesian, "m", {0, 1})};
  auto source =
      std::make_unique<FakeSource>(std::move(grid), std::vector<data::FieldInfo>{wind_info()}, 1);
  // Magnitudes are uniform up to 1 in the lower layer and up to 100 in the upper layer.
  source->values = [](const std::string&, std::size_t n) {
    const bool upper = n >= std::size_t{900} * 900;
    const double share = std::fmod(static_cast<double>(n) * 0.7548776662466927, 1.0);
    return share * (upper ? 100 : 1) / std::sqrt(3.0);
  };
  auto dataset = dataset_of(std::move(source));
  View view;
  view.vector.magnitude_range = protocol::Range{0, 1};
  view.geometry.vertical = protocol::VerticalPlacement::metric;
  const View whole = complete(view, *dataset)->view();
  EXPECT_EQ(*whole.vector.stride, 1) << "both layers are drawn";
  EXPECT_DOUBLE_EQ(*whole.vector.min_magnitude, 0.9) << "all but the top";
  view.geometry.slice = SliceView{GridAxis::z, 0};
  const auto full = complete(view, *dataset);
  ASSERT_TRUE(full);
  EXPECT_GT(*full->view().vector.stride, 5);
  EXPECT_LT(*full->view().vector.min_magnitude, 0.35);
}

TEST(Slice, LinesAndMediumAreScaledToTheLayer) {
  auto dataset = known_weather();
  View view;
  const Scene whole = built(view, *dataset);
  view.geometry.slice = SliceView{GridAxis::z, 1};
  const Scene slice = built(view, *dataset);
  // One of three equal layers: dense parts are as opaque through it as through all three.
  const auto top = [](const Scene& scene) { return scene.scalars.at(0).extinction.back()[1]; };
  EXPECT_NEAR(top(slice) / top(whole), 3, 0.6);  // both are rounded up to readable numbers
  // Across x, the length of lines is the spacing of y: 5 cells of 10 degrees on a scale of 40 to 2.
  view.geometry.slice = SliceView{GridAxis::x, 0};
  EXPECT_NEAR(built(view, *dataset).vector->length, 5 * 0.5, 0.05);
}

TEST(ColorByDirection, SpansTheCompass) {
  auto dataset = known_weather();
  View view;
  view.vector.color.by = ColorBy::direction;
  const Scene scene = built(view, *dataset);
  EXPECT_EQ(scene.vector->color_by, LineColor::direction);
  EXPECT_EQ(scene.vector->color.range, (std::array<double, 2>{0, 360}));
  EXPECT_FALSE(scene.vector->color_field);
}

TEST(ColorByScalar, UsesTheFieldAtTheStepAndTheRangeOfTheFirst) {
  auto reads = std::make_shared<FakeSource::Reads>();
  auto dataset = known_weather(reads);
  View view;
  view.step = 2;
  view.scalars.emplace();
  view.vector.color.by = ColorBy::scalar;
  view.vector.color.field = "temperature";
  const Scene scene = built(view, *dataset);
  EXPECT_EQ(scene.vector->color_by, LineColor::scalar);
  ASSERT_TRUE(scene.vector->color_field);
  EXPECT_EQ(scene.vector->color_field->component(0)[5], 2005);
  EXPECT_LE(scene.vector->color.range[1], 40);  // 36 samples from 0 to 35 at step 0
  EXPECT_GE(scene.vector->color.range[1], 30);
  EXPECT_EQ((*reads)["temperature@0"], 1);
  EXPECT_EQ((*reads)["temperature@2"], 1);
}

TEST(ColorByScalar, LoadsNothingThatIsNotRendered) {
  for (const bool lines : {true, false}) {
    auto reads = std::make_shared<FakeSource::Reads>();
    auto dataset = known_weather(reads);
    View view;
    view.scalars.emplace();
    view.vector.color.field = "temperature";
    view.vector.color.by = lines ? ColorBy::magnitude : ColorBy::scalar;
    if (!lines) view.vector.field = {protocol::FieldChoice::Kind::none, ""};
    built(view, *dataset);
    EXPECT_EQ(reads->count("temperature@0"), 0U) << lines;
  }
}

TEST(ColorByScalar, NeedsAScalarField) {
  auto dataset = known_weather();
  View view;
  view.vector.color.by = ColorBy::scalar;
  EXPECT_EQ(pointer_of_refusal(view, *dataset), "/vector/color/field");
  for (const char* name : {"wind", "nope"}) {
    view.vector.color.field = name;
    EXPECT_EQ(pointer_of_refusal(view, *dataset), "/vector/color/field") << name;
  }
  view.vector.color.field = "cloud";
  EXPECT_EQ(pointer_of_refusal(view, *dataset), "(taken)");
}

TEST(Motion, CyclesAreRateTimesStepAndTime) {
  auto dataset = known_weather();
  View view;
  view.step = 2;
  view.vector.motion_rate = 1.5;
  view.vector.motion_time = 0.25;
  EXPECT_FALSE(built(view, *dataset).vector->moving);
  view.vector.motion = protocol::MotionMode::phase;
  const Scene scene = built(view, *dataset);
  EXPECT_TRUE(scene.vector->moving);
  EXPECT_DOUBLE_EQ(scene.vector->motion_cycles, 1.5 * 2.25);
}

TEST(Methods, MatchThoseOfTheView) {
  auto dataset = known_weather();
  View view;
  EXPECT_EQ(built(view, *dataset).method, Method::slab);
  view.method.name = protocol::MethodName::kernel;
  EXPECT_EQ(built(view, *dataset).method, Method::kernel);
  view.method.name = protocol::MethodName::slab;
  view.method.compositing = protocol::Compositing::cd_euler;
  view.method.slab_thickness = 2.5;
  const Scene scene = built(view, *dataset);
  EXPECT_EQ(scene.method, Method::slab);
  EXPECT_EQ(scene.compositing, Compositing::cd_euler);
  EXPECT_EQ(scene.slab_thickness, 2.5);
  view.method.name = protocol::MethodName::reference;
  view.method.compositing = protocol::Compositing::cd_naive;
  EXPECT_EQ(built(view, *dataset).method, Method::reference);
  EXPECT_EQ(built(view, *dataset).compositing, Compositing::cd_naive);
}

}  // namespace
}  // namespace windsplat::scene
