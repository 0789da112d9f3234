// Where the ground of a placement lies on the Earth, and whether a view shows that.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "server/scene/build.hpp"
#include "server/scene/colormap.hpp"
#include "server/scene/earth/ground.hpp"
#include "server/scene/lattice.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using data::AxisKind;
using protocol::GeometryMapping;
using protocol::View;

data::Grid along_degrees() {
  data::Grid grid;
  grid.axes = {axis(AxisKind::longitude, "degrees_east", {350, 355, 365, 370}),
               axis(AxisKind::latitude, "degrees_north", {40, 43, 45}),
               axis(AxisKind::height, "m", {0, 100})};
  return grid;
}

// Rows and columns turned by 30 degrees against the compass.
data::Grid turned() {
  data::Grid grid;
  grid.axes = {axis(AxisKind::cartesian, "km", {0, 10, 20, 30, 40}),
               axis(AxisKind::cartesian, "km", {0, 10, 20, 30}),
               axis(AxisKind::height, "m", {0, 100})};
  auto columns = std::make_shared<data::Columns>();
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 5; ++i) {
      columns->longitude.push_back(175 + 2.6 * i - 1.0 * j + 0.03 * i * j);
      columns->latitude.push_back(40 + 1.5 * i + 2.6 * j + 0.02 * i * j);
    }
  }
  grid.columns = columns;
  return grid;
}

TEST(Earth, EveryColumnIsFoundAtItsOwnPlace) {
  for (const data::Grid& grid : {along_degrees(), turned()}) {
    for (const auto mapping :
         {GeometryMapping::flat, GeometryMapping::curvilinear, GeometryMapping::sphere}) {
      if (mapping == GeometryMapping::curvilinear && !grid.columns) continue;
      protocol::GeometryView geometry;
      geometry.mapping = mapping;
      geometry.scale = {1, 1.5, 2};
      auto lattice = place_lattice(grid, geometry);
      ASSERT_TRUE(lattice);
      Placed placed;
      placed.grid = grid;
      placed.lattice = std::move(*lattice);
      const auto map = map_of(geometry, placed);
      ASSERT_TRUE(map);
      const auto [width, height, levels] = grid.dims();
      for (int j = 0; j < height; ++j) {
        for (int i = 0; i < width; ++i) {
          const auto column = static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                              static_cast<std::size_t>(i);
          const auto x = static_cast<std::size_t>(i);
          const auto y = static_cast<std::size_t>(j);
          glm::dvec3 at(placed.lattice.positions[0][x], placed.lattice.positions[1][y], 0);
          if (placed.lattice.places) {
            const auto& p = (*placed.lattice.places)[column];
            at = {p[0], p[1], p[2]};
          }
          const double longitude =
              grid.columns ? grid.columns->longitude[column] : grid.axes[0].coordinates[x];
          const double latitude =
              grid.columns ? grid.columns->latitude[column] : grid.axes[1].coordinates[y];
          const ground::Place found = map->locate(at).place;
          EXPECT_NEAR(std::remainder(found.longitude - longitude, 360), 0, 1e-5);
          EXPECT_NEAR(found.latitude, latitude, 1e-5);
        }
      }
    }
  }
}

Scene ground_of(data::Grid grid, const protocol::GroundView& ground) {
  auto dataset = dataset_of(
      std::make_unique<FakeSource>(std::move(grid), std::vector<data::FieldInfo>{wind_info()}, 1));
  View view;
  view.ground = ground;
  view.ground.show = protocol::GroundShow::on;
  auto scene = build_scene(view, *dataset);
  EXPECT_TRUE(scene);
  return std::move(*scene);
}

TEST(Earth, IsShownWherePlacesAreKnown) {
  EXPECT_TRUE(ground_of(along_degrees(), {}).body->paint);
  EXPECT_TRUE(ground_of(turned(), {}).body->paint);
  data::Grid box = turned();
  box.columns = nullptr;
  protocol::GroundView all;
  all.borders = all.graticule = true;
  EXPECT_FALSE(ground_of(box, all).body->paint);
  data::Grid section = along_degrees();
  section.axes[1].coordinates = {40};
  EXPECT_FALSE(ground_of(section, all).body->paint);
}

// Whether a view of the grid shows a ground by default.
bool has_default_ground(data::Grid grid, const View& view = {}) {
  auto dataset = dataset_of(
      std::make_unique<FakeSource>(std::move(grid), std::vector<data::FieldInfo>{wind_info()}, 1));
  auto scene = build_scene(view, *dataset);
  EXPECT_TRUE(scene) << scene.error().message;
  return scene && scene->body.has_value();
}

TEST(Earth, LiesBelowTheAtmosphereByDefault) {
  EXPECT_TRUE(has_default_ground(along_degrees()));
  EXPECT_TRUE(has_default_ground(turned()));
  data::Grid box = turned();
  box.columns = nullptr;
  EXPECT_FALSE(has_default_ground(box));
  View off;
  off.ground.show = protocol::GroundShow::off;
  EXPECT_FALSE(has_default_ground(along_degrees(), off));
}

// Lines alone do not tell where the land is; a medium does, above a floor whose coasts lie aside.
TEST(Earth, LiesBelowASeaByDefaultWhereLinesAreDrawn) {
  data::Grid depths = along_degrees();
  depths.axes[2].kind = data::AxisKind::depth;
  data::Grid terms = along_degrees();
  terms.axes[2].standard_name = "ocean_s_coordinate_g2";
  data::Grid negative = along_degrees();
  negative.axes[2].kind = data::AxisKind::height;
  for (double& height : negative.axes[2].coordinates) height -= 1e6;
  View without;
  without.vector.field = {protocol::FieldChoice::Kind::none, ""};
  for (const data::Grid& sea : {depths, terms, negative}) {
    EXPECT_TRUE(has_default_ground(sea));
    EXPECT_FALSE(has_default_ground(sea, without));
  }
  EXPECT_TRUE(has_default_ground(along_degrees(), without));
  View layer = without;
  layer.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 0};
  EXPECT_TRUE(has_default_ground(depths, layer));
  layer.geometry.slice->axis = protocol::GridAxis::x;
  EXPECT_FALSE(has_default_ground(depths, layer));
  depths.axes[2].coordinates = {depths.axes[2].coordinates.front()};
  EXPECT_TRUE(has_default_ground(depths, without));
}

// It would hide all data.
TEST(Earth, IsNotDrawnBeforeAnEyeBelowIt) {
  View view;
  view.camera.target = {0, 0, 0};
  view.camera.eye = {0, -1, 2};
  EXPECT_TRUE(has_default_ground(along_degrees(), view));
  view.camera.eye = {0, -1, -2};
  EXPECT_FALSE(has_default_ground(along_degrees(), view));
  view.camera.projection = protocol::Projection::orthographic;
  EXPECT_FALSE(has_default_ground(along_degrees(), view));
  view.camera.eye = {0, -1, 2};
  EXPECT_TRUE(has_default_ground(along_degrees(), view));
}

TEST(Earth, AGroundWithoutLinesAndTintHasOneColor) {
  protocol::GroundView plain;
  plain.coastlines = plain.tint = false;
  EXPECT_FALSE(ground_of(along_degrees(), plain).body->paint);
  plain.graticule = true;
  const auto paint = ground_of(along_degrees(), plain).body->paint;
  ASSERT_TRUE(paint);
  // At 0.6 E, 42.9 N: far from every line.
  const ground::Seen seen{{0.05, 0.05, 0}, {1e-6, 0, 0}, {0, 1e-6, 0}, 1};
  const auto color = parse_color(plain.surface_color).value();
  const ground::Color found = paint->color(seen);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(found[c], static_cast<double>(color[c]), 1e-6);
  }
}

}  // namespace
}  // namespace windsplat::scene
