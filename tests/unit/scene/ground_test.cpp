// Which views have a terrain as their opaque body.
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using data::AxisKind;
using protocol::BodyShow;
using protocol::View;

// Heights "z" over 4 x 2 columns and three levels, the number of the sample or, if `step` is more
// than 1, of its run of `step` samples.
std::unique_ptr<data::Dataset> hills(data::Axis levels, std::size_t step = 1) {
  data::Grid grid;
  grid.axes = {axis(AxisKind::cartesian, "m", {0, 10, 20, 30}),
               axis(AxisKind::cartesian, "m", {0, 10}), std::move(levels)};
  auto source = std::make_unique<FakeSource>(
      std::move(grid), std::vector<data::FieldInfo>{wind_info(), scalar_info("z", "m")}, 1);
  source->values = [step](const std::string& field, std::size_t n) {
    return field == "z" ? static_cast<double>(n / step) : 1.0;
  };
  return dataset_of(std::move(source));
}

std::unique_ptr<FakeSource> relief_on_a_globe() {
  data::Grid grid;
  grid.axes = {axis(AxisKind::longitude, "degrees_east", {0, 15, 30, 45}),
               axis(AxisKind::latitude, "degrees_north", {0, 15}),
               axis(AxisKind::level, "", {0, 1, 2})};
  auto source = std::make_unique<FakeSource>(
      std::move(grid), std::vector<data::FieldInfo>{wind_info(), scalar_info("z", "m")}, 1);
  source->values = [](const std::string& field, std::size_t n) {
    return field == "z" ? 1000.0 * static_cast<double>(n) : 1.0;
  };
  return source;
}

View with_heights(BodyShow show) {
  View view;
  view.scalars.emplace();
  view.geometry.height_field = "z";
  view.geometry.body.show = show;
  return view;
}

Scene built_of(const View& view, data::Dataset& dataset) {
  auto scene = build_scene(view, dataset);
  if (!scene) throw std::runtime_error(scene.error().message);
  return std::move(*scene);
}

TEST(Ground, IsTheTerrainOfAHeightFieldIfItIsOn) {
  auto dataset = hills(axis(AxisKind::level, "", {0, 1, 2}));
  const Scene scene = built_of(with_heights(BodyShow::on), *dataset);
  ASSERT_TRUE(scene.body);
  EXPECT_EQ(scene.body->shape, BodyShape::terrain);
  ASSERT_TRUE(scene.body->terrain);
  const Scene again = built_of(with_heights(BodyShow::on), *dataset);
  EXPECT_EQ(again.body->terrain, scene.body->terrain) << "it is made once";
  EXPECT_FALSE(built_of(with_heights(BodyShow::automatic), *dataset).body);
  EXPECT_FALSE(built_of(with_heights(BodyShow::off), *dataset).body);
}

TEST(Ground, IsARectangleBelowLevelsOfConstantHeight) {
  auto dataset = hills(axis(AxisKind::level, "", {0, 1, 2}), 8);
  const Scene scene = built_of(with_heights(BodyShow::on), *dataset);
  ASSERT_TRUE(scene.body);
  EXPECT_EQ(scene.body->shape, BodyShape::ground);
  EXPECT_FALSE(scene.body->terrain);
}

// Heights over a globe of 45 degrees, "z" rising from column to column.
TEST(Ground, OfAGlobeHasATerrainOnlyIfItIsOn) {
  auto dataset = dataset_of(relief_on_a_globe());
  View view = with_heights(BodyShow::automatic);
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  const Scene plain = built_of(view, *dataset);
  ASSERT_TRUE(plain.body);
  EXPECT_EQ(plain.body->shape, BodyShape::sphere);
  EXPECT_FALSE(plain.body->terrain);
  view.geometry.body.show = BodyShow::on;
  const Scene scene = built_of(view, *dataset);
  ASSERT_TRUE(scene.body);
  EXPECT_EQ(scene.body->shape, BodyShape::sphere);
  EXPECT_TRUE(scene.body->terrain);
}

TEST(Ground, IsARectangleBelowLevelsOfPressure) {
  auto dataset = hills(axis(AxisKind::pressure, "hPa", {1000, 850, 700}));
  EXPECT_FALSE(built_of(with_heights(BodyShow::automatic), *dataset).body);
  const Scene scene = built_of(with_heights(BodyShow::on), *dataset);
  ASSERT_TRUE(scene.body);
  EXPECT_EQ(scene.body->shape, BodyShape::ground);
  EXPECT_FALSE(scene.body->terrain);
}

}  // namespace
}  // namespace windsplat::scene
