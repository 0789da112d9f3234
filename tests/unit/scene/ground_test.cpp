// Which views have a terrain as their opaque body, and where it lies.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "server/terrain/terrain.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using data::AxisKind;
using protocol::GroundShow;
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

View with_heights(GroundShow show) {
  View view;
  view.scalars.emplace();
  view.geometry.height_field = "z";
  view.ground.show = show;
  return view;
}

Scene built_of(const View& view, data::Dataset& dataset) {
  auto scene = build_scene(view, dataset);
  if (!scene) throw std::runtime_error(scene.error().message);
  return std::move(*scene);
}

TEST(Ground, IsTheTerrainOfAHeightFieldIfItIsOn) {
  auto dataset = hills(axis(AxisKind::level, "", {0, 1, 2}));
  const Scene scene = built_of(with_heights(GroundShow::on), *dataset);
  ASSERT_TRUE(scene.body);
  EXPECT_EQ(scene.body->shape, BodyShape::terrain);
  ASSERT_TRUE(scene.body->terrain);
  const Scene again = built_of(with_heights(GroundShow::on), *dataset);
  EXPECT_EQ(again.body->terrain, scene.body->terrain) << "it is made once";
  EXPECT_FALSE(built_of(with_heights(GroundShow::automatic), *dataset).body);
  EXPECT_FALSE(built_of(with_heights(GroundShow::off), *dataset).body);
}

TEST(Ground, IsARectangleBelowLevelsOfConstantHeight) {
  auto dataset = hills(axis(AxisKind::level, "", {0, 1, 2}), 8);
  const Scene scene = built_of(with_heights(GroundShow::on), *dataset);
  ASSERT_TRUE(scene.body);
  EXPECT_EQ(scene.body->shape, BodyShape::ground);
  EXPECT_FALSE(scene.body->terrain);
}

// Heights over a globe of 45 degrees, "z" rising from column to column.
TEST(Ground, OfAGlobeHasATerrainOnlyIfItIsOn) {
  auto dataset = dataset_of(relief_on_a_globe());
  View view = with_heights(GroundShow::automatic);
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  const Scene plain = built_of(view, *dataset);
  ASSERT_TRUE(plain.body);
  EXPECT_EQ(plain.body->shape, BodyShape::sphere);
  EXPECT_FALSE(plain.body->terrain);
  view.ground.show = GroundShow::on;
  const Scene scene = built_of(view, *dataset);
  ASSERT_TRUE(scene.body);
  EXPECT_EQ(scene.body->shape, BodyShape::sphere);
  EXPECT_TRUE(scene.body->terrain);
}

TEST(Ground, IsARectangleBelowLevelsOfPressure) {
  auto dataset = hills(axis(AxisKind::pressure, "hPa", {1000, 850, 700}));
  EXPECT_FALSE(built_of(with_heights(GroundShow::automatic), *dataset).body);
  const Scene scene = built_of(with_heights(GroundShow::on), *dataset);
  ASSERT_TRUE(scene.body);
  EXPECT_EQ(scene.body->shape, BodyShape::ground);
  EXPECT_FALSE(scene.body->terrain);
}

// --- the ground of the file --------------------------------------------------------------------

const std::vector<float> relief{0, 5, 12, 7, 3, 9, 1, 20};  // metres, 4 x 2 columns

std::shared_ptr<const data::Ground> ground_of(std::vector<float> heights,
                                              data::GroundKind kind = data::GroundKind::land) {
  return std::make_shared<const data::Ground>(data::Ground{"orog", kind, std::move(heights)});
}

data::Axis named(data::Axis levels, const std::string& standard_name) {
  levels.standard_name = standard_name;
  return levels;
}

// 4 x 2 columns and three levels with that ground. Heights "z" have the standard name `of_heights`
// and are 10 m, 30 m and 70 m above `base`; without it there are none.
std::unique_ptr<data::Dataset> over_ground(data::Axis levels,
                                           std::shared_ptr<const data::Ground> ground,
                                           const std::string& of_heights = "",
                                           const std::vector<float>& base = relief) {
  data::Grid grid;
  grid.axes = {axis(AxisKind::cartesian, "m", {0, 10, 20, 30}),
               axis(AxisKind::cartesian, "m", {0, 10}), std::move(levels)};
  grid.ground = std::move(ground);
  std::vector<data::FieldInfo> fields{wind_info()};
  if (!of_heights.empty()) {
    fields.push_back(scalar_info("z", "m"));
    fields.back().standard_name = of_heights == "none" ? "" : of_heights;
  }
  auto source = std::make_unique<FakeSource>(std::move(grid), std::move(fields), 1);
  source->values = [base](const std::string& field, std::size_t n) {
    constexpr std::array<double, 3> rise{10, 30, 70};
    return field == "z" ? static_cast<double>(base[n % 8]) + rise[n / 8] : 1.0;
  };
  return dataset_of(std::move(source));
}

View shown(bool with_heights) {
  View view;
  view.scalars.emplace();
  if (with_heights) view.geometry.height_field = "z";
  view.ground.show = GroundShow::on;
  return view;
}

// The vertices at the columns, whose heights are those of `relief` as z = offset + scale height.
void expect_relief(const Scene& scene, double offset, double scale) {
  ASSERT_TRUE(scene.body);
  EXPECT_EQ(scene.body->shape, BodyShape::terrain);
  ASSERT_TRUE(scene.body->terrain);
  const terrain::Terrain& terrain = *scene.body->terrain;
  ASSERT_EQ(terrain.width(), 6);
  ASSERT_EQ(terrain.height(), 4);
  for (int c = 0; c < 8; ++c) {
    const auto height = static_cast<double>(relief[static_cast<std::size_t>(c)]);
    const glm::dvec3 at = terrain.vertex(c % 4 + 1, c / 4 + 1);
    EXPECT_NEAR(at.z, offset + scale * height, 1e-6) << c;
  }
}

TEST(GroundOfTheFile, LiesAtItsHeightBelowLevelsThatFollowIt) {
  auto dataset = over_ground(axis(AxisKind::level, "", {0, 1, 2}), ground_of(relief), "altitude");
  const Scene scene = built_of(shown(true), *dataset);
  const auto& places = *scene.lattice.places;
  const auto z = [&](std::size_t n) { return static_cast<double>(places[n][2]); };
  const double scale = (z(8) - z(0)) / 20;  // from 10 m to 30 m
  expect_relief(scene, z(0) - 10 * scale, scale);
  for (std::size_t c = 0; c < 4; ++c) {
    const glm::dvec3 at = scene.body->terrain->vertex(static_cast<int>(c) + 1, 1);
    EXPECT_NEAR(at.x, static_cast<double>(places[c][0]), 1e-6);
  }
  EXPECT_LT(scene.body->terrain->vertex(0, 1).x, static_cast<double>(places[0][0]));
}

TEST(GroundOfTheFile, LiesAmongLevelsOfConstantHeightAboveTheSea) {
  auto dataset = over_ground(named(axis(AxisKind::height, "km", {0, 0.01, 0.03}), "altitude"),
                             ground_of(relief));
  const Scene scene = built_of(shown(false), *dataset);
  const auto& z = scene.lattice.positions[2];
  expect_relief(scene, z[0], (z[2] - z[0]) / 30);
}

TEST(GroundOfTheFile, IsTheFloorAmongDepths) {
  std::vector<float> below;
  for (const float height : relief) below.push_back(height - 30);
  const auto floor = ground_of(below, data::GroundKind::sea_floor);
  auto dataset = over_ground(axis(AxisKind::depth, "m", {30, 20, 0}), floor);
  const Scene scene = built_of(shown(false), *dataset);
  const auto& z = scene.lattice.positions[2];
  expect_relief(scene, z[0], (z[2] - z[0]) / 30);
  auto soil = over_ground(axis(AxisKind::depth, "m", {30, 20, 0}), ground_of(relief));
  EXPECT_EQ(built_of(shown(false), *soil).body->shape, BodyShape::ground)
      << "depths below the ground do not count from the sea";
}

TEST(GroundOfTheFile, NeedsHeightsOnSurfacesOfPressure) {
  const auto levels = axis(AxisKind::pressure, "hPa", {1000, 850, 700});
  auto dataset = over_ground(levels, ground_of(relief), "geopotential_height");
  EXPECT_EQ(built_of(shown(false), *dataset).body->shape, BodyShape::ground);
  const Scene scene = built_of(shown(true), *dataset);
  const double low = static_cast<double>((*scene.lattice.places)[0][2]);
  const double next = static_cast<double>((*scene.lattice.places)[8][2]);
  expect_relief(scene, low - (next - low) / 2, (next - low) / 20);
  auto standard = over_ground(levels, ground_of(relief), "none");
  EXPECT_EQ(built_of(shown(true), *standard).body->shape, BodyShape::ground)
      << "heights of the standard atmosphere are no altitudes";
}

// Levels that follow the terrain stand at mean heights without their field of heights.
TEST(GroundOfTheFile, IsNotDrawnAmongMeanHeights) {
  auto dataset = over_ground(named(axis(AxisKind::height, "m", {20, 40, 80}), "altitude"),
                             ground_of(relief), "altitude");
  EXPECT_EQ(built_of(shown(false), *dataset).body->shape, BodyShape::ground);
  EXPECT_EQ(built_of(shown(true), *dataset).body->shape, BodyShape::terrain);
}

TEST(GroundOfTheFile, IsNotDrawnAmongHeightsAboveTheGround) {
  auto axis_only =
      over_ground(named(axis(AxisKind::height, "m", {2, 10, 50}), "height"), ground_of(relief));
  EXPECT_EQ(built_of(shown(false), *axis_only).body->shape, BodyShape::ground);
  const std::vector<float> above_ground{0, 0, 0, 0, 0, 0, 0, 0.5};
  std::vector<float> mountains;
  for (const float height : relief) mountains.push_back(100 * height);
  auto dataset = over_ground(axis(AxisKind::level, "", {0, 1, 2}), ground_of(mountains), "height",
                             above_ground);
  const Scene scene = built_of(shown(true), *dataset);
  ASSERT_TRUE(scene.body->terrain);
  const double low = scene.body->terrain->vertex(1, 1).z;
  EXPECT_NEAR(scene.body->terrain->vertex(2, 1).z, low, 1e-6) << "the bottom of the lowest cells";
}

TEST(GroundOfTheFile, IsOpenWhereItIsUnknown) {
  std::vector<float> heights = relief;
  heights[5] = std::numeric_limits<float>::quiet_NaN();
  auto dataset = over_ground(axis(AxisKind::level, "", {0, 1, 2}), ground_of(heights), "altitude");
  const Scene scene = built_of(shown(true), *dataset);
  ASSERT_TRUE(scene.body->terrain);
  for (int c = 0; c < 8; ++c) {
    const bool open = std::isnan(scene.body->terrain->vertex(c % 4 + 1, c / 4 + 1).z);
    EXPECT_EQ(open, c == 5) << c;
  }
}

TEST(GroundOfTheFile, LiesOnAGlobeAtItsHeight) {
  data::Grid grid;
  grid.axes = {axis(AxisKind::longitude, "degrees_east", {0, 15, 30, 45}),
               axis(AxisKind::latitude, "degrees_north", {0, 15}),
               named(axis(AxisKind::height, "m", {0, 10, 20}), "altitude")};
  grid.ground = ground_of(relief);
  auto dataset = dataset_of(
      std::make_unique<FakeSource>(std::move(grid), std::vector<data::FieldInfo>{wind_info()}, 1));
  View view = shown(false);
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  const Scene scene = built_of(view, *dataset);
  ASSERT_TRUE(scene.body && scene.body->terrain);
  const auto radius = [&](std::size_t n) {
    const auto& p = (*scene.lattice.places)[n];
    return glm::length(glm::dvec3(p[0], p[1], p[2]));
  };
  for (std::size_t c = 0; c < 8; ++c) {
    const auto height = static_cast<double>(relief[c]);
    const double expected = radius(0) + (radius(16) - radius(0)) * height / 20;
    const glm::dvec3 at =
        scene.body->terrain->vertex(static_cast<int>(c % 4) + 1, static_cast<int>(c / 4) + 1);
    EXPECT_NEAR(glm::length(at), expected, 1e-6) << c;
  }
}

// --- masked heights and memory
// --------------------------------------------------------------------

// Below the lowest sample that is not masked; columns without any are open.
TEST(Ground, IsOpenBelowMaskedColumns) {
  data::Grid grid;
  grid.axes = {axis(AxisKind::cartesian, "m", {0, 10, 20, 30}),
               axis(AxisKind::cartesian, "m", {0, 10}), axis(AxisKind::level, "", {0, 1, 2})};
  auto source = std::make_unique<FakeSource>(
      std::move(grid), std::vector<data::FieldInfo>{wind_info(), scalar_info("z", "m")}, 1);
  source->values = [](const std::string& field, std::size_t n) {
    const std::size_t column = n % 8;
    const bool masked = column == 6 || (column == 1 && n / 8 == 0);
    if (field != "z") return 1.0;
    return masked ? std::nan("") : 10.0 * static_cast<double>(n / 8);
  };
  auto dataset = dataset_of(std::move(source));
  const Scene scene = built_of(with_heights(GroundShow::on), *dataset);
  ASSERT_TRUE(scene.body && scene.body->terrain);
  const auto& places = *scene.lattice.places;
  for (std::size_t c = 0; c < 8; ++c) {
    const glm::dvec3 at =
        scene.body->terrain->vertex(static_cast<int>(c % 4) + 1, static_cast<int>(c / 4) + 1);
    if (c == 6) {
      EXPECT_TRUE(std::isnan(at.z));
      continue;
    }
    const std::size_t lowest = c == 1 ? 1 : 0;
    const auto z = [&](std::size_t k) { return static_cast<double>(places[8 * k + c][2]); };
    EXPECT_NEAR(at.z, z(lowest) - 0.5 * (z(lowest + 1) - z(lowest)), 1e-6) << c;
  }
}

TEST(Ground, CountsTowardTheMemoryLimit) {
  auto dataset = over_ground(axis(AxisKind::level, "", {0, 1, 2}), ground_of(relief), "altitude");
  View view = shown(true);
  view.ground.show = GroundShow::off;
  built_of(view, *dataset);
  const std::uint64_t before = dataset->resident_bytes();
  view.ground.show = GroundShow::on;
  const Scene scene = built_of(view, *dataset);
  const std::uint64_t bytes = terrain::bytes_of(6, 4);
  EXPECT_GE(bytes, scene.body->terrain->bytes());
  EXPECT_EQ(dataset->resident_bytes(), before + bytes);
  data::Dataset resident = dataset->resident_only();
  EXPECT_TRUE(build_scene(view, resident));
}

TEST(Ground, IsMadeByTheThreadThatLoads) {
  auto dataset = over_ground(axis(AxisKind::level, "", {0, 1, 2}), ground_of(relief), "altitude");
  View view = shown(true);
  view.ground.show = GroundShow::off;
  built_of(view, *dataset);
  view.ground.show = GroundShow::on;
  data::Dataset resident = dataset->resident_only();
  const auto early = build_scene(view, resident);
  ASSERT_FALSE(early);
  EXPECT_EQ(early.error().kind, ErrorKind::not_resident);
  built_of(view, *dataset);
  EXPECT_TRUE(build_scene(view, resident));
}

}  // namespace
}  // namespace windsplat::scene
