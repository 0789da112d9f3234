// Surfaces and streamlets of a region: from its samples alone, at their places in the whole.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/lattice.hpp"
#include "tests/unit/scene/earth.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::View;

// The value of a sample is its index along x.
std::unique_ptr<data::Dataset> eastward() {
  auto source = std::make_unique<FakeSource>(
      whole_earth(), std::vector{wind_info(), scalar_info("cloud", "1")}, 1);
  source->values = [](const std::string&, std::size_t n) { return static_cast<double>(n % 36); };
  return dataset_of(std::move(source));
}

View of_region() {
  View view;
  view.scalars.emplace();
  view.method.detail = protocol::Detail::full;
  view.region.x = {100, 200};
  view.region.y = {-30, 40};
  return view;
}

double place_of(double index) {
  const Lattice whole = place_lattice(whole_earth(), {}).value();
  const std::vector<double>& x = whole.positions[0];
  return x[0] + index * (x[1] - x[0]);
}

TEST(RegionParts, OneLayerIsFacedAndHasNoSurfaces) {
  auto dataset = eastward();
  View view = of_region();
  const auto& levels = dataset->info().grid.axes[2].coordinates;
  view.region.z = {levels[1], levels[1]};
  const Scene scene = built(view, *dataset);
  EXPECT_NEAR(scene.camera.forward.z, -1, 1e-12);
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  EXPECT_TRUE(complete(view, *dataset));
  view.geometry.mapping = protocol::GeometryMapping::flat;
  view.surfaces.emplace_back().field = "cloud";
  view.surfaces.back().isovalue = 14.25;
  const auto refused = build_scene(view, *dataset);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  EXPECT_EQ(refused.error().at.at(0).pointer, "/surfaces/0");
}

TEST(RegionParts, SurfacesLieWhereTheirSamplesAre) {
  auto dataset = eastward();
  View view = of_region();
  view.surfaces.emplace_back().field = "cloud";
  view.surfaces.back().isovalue = 14.25;
  view.surfaces.emplace_back().field = "cloud";
  view.surfaces.back().slice = protocol::SliceView{protocol::GridAxis::x, 13};
  const Scene scene = built(view, *dataset);
  ASSERT_EQ(scene.surfaces.size(), 2U);
  ASSERT_FALSE(scene.surfaces[0].mesh->places.empty());
  for (const auto& place : scene.surfaces[0].mesh->places) {
    EXPECT_NEAR(place[0], place_of(14.25), 1e-6);
    EXPECT_GE(place[1], scene.lattice.box_min.y);
    EXPECT_LE(place[1], scene.lattice.box_max.y);
  }
  ASSERT_FALSE(scene.surfaces[1].mesh->places.empty());
  for (const auto& place : scene.surfaces[1].mesh->places) {
    EXPECT_NEAR(place[0], place_of(13), 1e-6);
  }
  for (const float value : scene.surfaces[1].mesh->values) EXPECT_NEAR(value, 13, 1e-5);
}

TEST(RegionParts, ALayerThatTheRegionLeavesOutIsRefused) {
  auto dataset = eastward();
  View view = of_region();
  view.surfaces.emplace_back().field = "cloud";
  view.surfaces.back().slice = protocol::SliceView{protocol::GridAxis::x, 5};
  const auto full = complete(view, *dataset);
  ASSERT_TRUE(full) << full.error().message;
  const auto scene = build_scene(*full, *dataset);
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().at.front().pointer, "/surfaces/0/slice/index");
}

TEST(RegionParts, SurfacesFollowFiltersOfAll) {
  auto dataset = eastward();
  View view = of_region();
  view.surfaces.emplace_back().field = "cloud";
  view.surfaces.back().isovalue = 14.25;
  view.region.where = {{"cloud", {16, 20}, protocol::FilterOf::lines}};
  EXPECT_FALSE(built(view, *dataset).surfaces.at(0).mesh->places.empty());
  view.region.where[0].of = protocol::FilterOf::all;
  EXPECT_TRUE(built(view, *dataset).surfaces.at(0).mesh->places.empty());
}

// They are kept between pictures: each region has its own.
TEST(RegionParts, StreamletsAreThoseOfTheRegionThatIsDrawn) {
  auto dataset = eastward();
  View view = of_region();
  view.vector.trace.emplace();
  view.vector.min_magnitude = 0;
  const Scene part = built(view, *dataset);
  view.region = {};
  const Scene whole = built(view, *dataset);
  ASSERT_TRUE(part.vector->streamlets && whole.vector->streamlets);
  EXPECT_LT(part.vector->streamlets->places.size(), whole.vector->streamlets->places.size() / 2);
  view.region.where = {{"cloud", {12, 20}}};
  const Scene filtered = built(view, *dataset);
  EXPECT_NE(filtered.vector->streamlets, whole.vector->streamlets);
}

}  // namespace
}  // namespace windsplat::scene
