// Surfaces from the view to the scene: fields, colours, what is refused, what is kept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/scene/defaults.hpp"
#include "server/scene/surfaces/make_surfaces.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::SurfaceView;
using protocol::View;

// Values of t are n: 12 in a layer, from 0 to 35.
std::unique_ptr<data::Dataset> weather_of_t(std::shared_ptr<FakeSource::Reads> reads = nullptr) {
  return dataset_of(std::make_unique<FakeSource>(
      atmosphere_grid(),
      std::vector<data::FieldInfo>{wind_info(), scalar_info("t", "K"), scalar_info("q", "1")}, 3,
      std::move(reads)));
}

View view_of(const SurfaceView& surface) {
  View view;
  view.surfaces = {surface};
  return view;
}

SurfaceView isosurface(double value) {
  SurfaceView surface;
  surface.field = "t";
  surface.isovalue = value;
  return surface;
}

SurfaceView layer(protocol::GridAxis axis, double index) {
  SurfaceView surface;
  surface.field = "t";
  surface.slice = protocol::SliceView{axis, index};
  return surface;
}

std::string refused_at(const SurfaceView& surface, data::Dataset& dataset) {
  const auto refused = complete(view_of(surface), dataset);
  if (refused || refused.error().at.empty()) return "(taken)";
  EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  return refused.error().at[0].pointer;
}

TEST(SurfaceView, WhatTheDatasetDoesNotAllowIsRefusedWhereItIs) {
  auto dataset = weather_of_t();
  EXPECT_EQ(refused_at(isosurface(13), *dataset), "(taken)");
  SurfaceView surface = isosurface(13);
  surface.field = "wind";
  EXPECT_EQ(refused_at(surface, *dataset), "/surfaces/0/field");
  surface = isosurface(13);
  surface.color.field = "r";
  EXPECT_EQ(refused_at(surface, *dataset), "/surfaces/0/color/field");
  surface.color.field.reset();
  surface.color.map = "none";
  EXPECT_EQ(refused_at(surface, *dataset), "/surfaces/0/color/map");
  EXPECT_EQ(refused_at(layer(protocol::GridAxis::x, 3), *dataset), "(taken)");
  EXPECT_EQ(refused_at(layer(protocol::GridAxis::y, 2.5), *dataset), "/surfaces/0/slice/index");
  data::Grid flat = atmosphere_grid();
  flat.axes[2].coordinates = {1000};
  auto map = dataset_of(std::make_unique<FakeSource>(
      flat, std::vector<data::FieldInfo>{wind_info(), scalar_info("t", "K")}, 1));
  EXPECT_EQ(refused_at(isosurface(3), *map), "/surfaces/0");
}

TEST(SurfaceView, AnIsosurfaceLiesWhereTheFieldHasItsValue) {
  auto dataset = weather_of_t();
  // Halfway between the layers of 0 to 11 and 12 to 23, at 12 (k + 1/2) + n in each column.
  View view = view_of(isosurface(17));
  const Scene scene = built(view, *dataset);
  ASSERT_EQ(scene.surfaces.size(), 1U);
  const surface::Shown& shown = scene.surfaces[0];
  EXPECT_EQ(shown.colors.size(), 1U);
  EXPECT_LT(shown.ambient, 1);
  ASSERT_FALSE(shown.mesh->triangles.empty());
  const auto& positions = scene.lattice.positions;
  for (const surface::Point& p : shown.mesh->places) {
    double value = 0;
    double factor = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto& at = positions.at(a);
      std::size_t i = 0;
      while (i + 2 < at.size() && at[i + 1] < static_cast<double>(p.at(a))) ++i;
      value += factor * (static_cast<double>(i) +
                         (static_cast<double>(p.at(a)) - at[i]) / (at[i + 1] - at[i]));
      factor *= static_cast<double>(at.size());
    }
    EXPECT_NEAR(value, 17, 1e-4);
  }
}

TEST(SurfaceView, ASectionIsColouredByItsFieldOverTheDefaultRange) {
  auto dataset = weather_of_t();
  SurfaceView surface = layer(protocol::GridAxis::z, 1.5);
  surface.contours = protocol::ContoursView{2, 1.5, "#ff0000", {17, 18.5}};
  View view = view_of(surface);
  view.image.height = 1440;
  const auto completed = complete(view, *dataset);
  ASSERT_TRUE(completed);
  ASSERT_TRUE(completed->view().surfaces[0].color.range);
  const Scene scene = built(view, *dataset);
  const surface::Shown& shown = scene.surfaces.at(0);
  EXPECT_EQ(shown.colors.size(), 256U);
  EXPECT_EQ(shown.ambient, 1);
  EXPECT_EQ(shown.contours.step, 2);
  EXPECT_EQ(shown.contours.width, 3);
  EXPECT_EQ(shown.contours.levels, (std::vector<double>{17, 18.5}));
  ASSERT_EQ(shown.mesh->values.size(), 12U);
  EXPECT_EQ(shown.mesh->values.front(), 18);  // between 12 and 24
  EXPECT_EQ(shown.mesh->triangles.size(), 2U * 3 * 2);
}

std::vector<std::string> reasons_of(const View& view, data::Dataset& dataset) {
  const auto completed = complete(view, dataset);
  EXPECT_TRUE(completed);
  return why_no_surfaces(*completed, dataset).value();
}

TEST(SurfaceView, OneWithoutTrianglesTellsWhy) {
  auto dataset = weather_of_t();
  EXPECT_THAT(reasons_of(view_of(isosurface(13)), *dataset), testing::IsEmpty());
  View beyond = view_of(isosurface(300));
  beyond.surfaces.push_back(isosurface(13));
  EXPECT_THAT(reasons_of(beyond, *dataset),
              testing::ElementsAre("/surfaces/0/isovalue 300 is beyond the values of \"t\", "
                                   "0 to 35"));
  // The middle layer is masked: of the isosurfaces only those between other layers are seen.
  auto source = std::make_unique<FakeSource>(
      atmosphere_grid(), std::vector<data::FieldInfo>{scalar_info("t", "K"), scalar_info("q", "1")},
      1);
  source->values = [](const std::string& field, std::size_t n) {
    if (field == "q" || n / 12 == 1) return std::numeric_limits<double>::quiet_NaN();
    return static_cast<double>(n);
  };
  auto masked = dataset_of(std::move(source));
  EXPECT_THAT(reasons_of(view_of(layer(protocol::GridAxis::z, 1)), *masked),
              testing::ElementsAre("/surfaces/0: the section lies outside the data, or where \"t\" "
                                   "is masked at step 0"));
  EXPECT_THAT(reasons_of(view_of(isosurface(17)), *masked),
              testing::ElementsAre("/surfaces/0/isovalue 17: \"t\" does not cross it between "
                                   "samples that are not masked"));
  SurfaceView none = isosurface(3);
  none.field = "q";
  EXPECT_THAT(reasons_of(view_of(none), *masked),
              testing::ElementsAre("/surfaces/0: every sample of \"q\" is masked at step 0"));
}

TEST(SurfaceView, APlaneThroughAnOutermostLayerIsSeenFromBothSides) {
  auto dataset = weather_of_t();
  const Lattice lattice = built(View{}, *dataset).lattice;
  for (const double z : {lattice.positions[2].front(), lattice.positions[2].back()}) {
    for (const double up : {-1.0, 1.0}) {
      SurfaceView surface;
      surface.field = "t";
      surface.plane = protocol::PlaneView{{0, 0, z}, {0, 0, up}};
      const Scene scene = built(view_of(surface), *dataset);
      EXPECT_EQ(scene.surfaces.at(0).mesh->triangles.size(), 2U * 3 * 2) << z << ' ' << up;
    }
  }
}

TEST(SurfaceView, ADescendingRangeReversesTheMap) {
  auto dataset = weather_of_t();
  SurfaceView surface = layer(protocol::GridAxis::z, 1);
  surface.color.range = protocol::Range{0, 10};
  const Scene up = built(view_of(surface), *dataset);
  surface.color.range = protocol::Range{10, 0};
  const Scene down = built(view_of(surface), *dataset);
  EXPECT_EQ(down.surfaces.at(0).range, (std::array<double, 2>{0, 10}));
  EXPECT_EQ(up.surfaces.at(0).colors.front(), down.surfaces.at(0).colors.back());
}

TEST(SurfaceView, TrianglesAreKeptUntilFieldStepOrCutChange) {
  auto dataset = weather_of_t();
  const auto mesh_of = [&](const View& view) { return built(view, *dataset).surfaces.at(0).mesh; };
  View view = view_of(isosurface(17));
  const auto first = mesh_of(view);
  view.surfaces[0].opacity = 0.25;
  view.camera.eye = protocol::Vec3{0, -4, 1};
  EXPECT_EQ(mesh_of(view), first);
  view.surfaces[0].color.field = "q";
  EXPECT_NE(mesh_of(view), first);
  view = view_of(isosurface(18));
  EXPECT_NE(mesh_of(view), first);
  view = view_of(isosurface(1017));
  view.step = 1;
  const auto later = mesh_of(view);
  EXPECT_NE(later, first);
  EXPECT_EQ(later->places, first->places);
}

TEST(SurfaceView, OnlyTheFieldsThatAreSeenAreRead) {
  auto reads = std::make_shared<FakeSource::Reads>();
  auto dataset = weather_of_t(reads);
  View view = view_of(isosurface(17));
  view.vector.field.kind = protocol::FieldChoice::Kind::none;
  view.scalars.emplace();
  (void)built(view, *dataset);
  EXPECT_EQ(*reads, (FakeSource::Reads{{"t@0", 1}}));
  EXPECT_THAT(fields_of(view, dataset->info()), testing::ElementsAre("t"));
}

}  // namespace
}  // namespace windsplat::scene
