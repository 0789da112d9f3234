// The light of views: what a dataset keeps of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "server/data/samples/samples.hpp"
#include "server/light/ground_light.hpp"
#include "server/light/sunlight.hpp"
#include "server/scene/build.hpp"

namespace windsplat::test {
namespace {

class LightOfAView : public ::testing::Test {
 protected:
  LightOfAView() {
    auto source = data::open_sample("climate", {40, 24, 10}, 2);
    dataset = std::make_unique<data::Dataset>(std::move(*source), "climate", 64U << 20U);
    view.dataset = "climate";
    view.image.width = 400;
    view.image.height = 300;
    view.light.emplace();
  }
  scene::Scene built() const { return scene::build_scene(view, *dataset).value(); }
  // Whether the sunlight of the changed view is that of the view.
  bool keeps(const std::function<void(protocol::View&)>& change) {
    const auto before = built().light->sunlight;
    protocol::View changed = view;
    change(changed);
    const auto after = scene::build_scene(changed, *dataset).value();
    return after.light->sunlight == before;
  }

  std::unique_ptr<data::Dataset> dataset;
  protocol::View view;
};

TEST_F(LightOfAView, IsKeptWhileCameraSizeAndMethodChange) {
  EXPECT_TRUE(keeps([](protocol::View& v) { v.camera.eye = protocol::Vec3{1, -3, 1}; }));
  EXPECT_TRUE(keeps([](protocol::View& v) { v.method.name = protocol::MethodName::kernel; }));
  EXPECT_TRUE(keeps([](protocol::View& v) { v.vector.opacity = 0.1; }));
  EXPECT_TRUE(keeps([](protocol::View& v) { v.light->ambient = 0.9; }));
  EXPECT_TRUE(keeps([](protocol::View& v) { v.light->anisotropy = 0.5; }));
  const auto levels = dataset->levels();
  view.camera.eye = protocol::Vec3{2, -3, 1};
  const std::uint64_t bytes = dataset->resident_bytes();
  built();
  EXPECT_EQ(dataset->levels(), levels);
  EXPECT_EQ(dataset->resident_bytes(), bytes);
}

TEST_F(LightOfAView, FollowsTheSunTheStepTheMediaAndTheGeometry) {
  EXPECT_FALSE(keeps([](protocol::View& v) { v.light->azimuth = 10; }));
  EXPECT_FALSE(keeps([](protocol::View& v) { v.light->shadows = 1; }));
  EXPECT_FALSE(keeps([](protocol::View& v) { v.step = 1; }));
  EXPECT_FALSE(keeps([](protocol::View& v) { v.geometry.scale = {1, 1, 2}; }));
  const auto scene = scene::complete(view, *dataset).value();
  EXPECT_FALSE(keeps([&](protocol::View& v) {
    v.scalars = scene.view().scalars;
    for (auto& point : *v.scalars->front().extinction) point[1] *= 2;
  }));
}

TEST_F(LightOfAView, CountsTowardsTheMemoryOfTheDataset) {
  view.light.reset();
  built();
  const std::uint64_t before = dataset->resident_bytes();
  view.light.emplace();
  built();
  // Two bytes for each sample, and for each column on the ground.
  EXPECT_EQ(dataset->resident_bytes(), before + 2U * 40 * 24 * 10 + 2U * 40 * 24);
}

TEST_F(LightOfAView, IsAbsentWithoutItAndInSlices) {
  view.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 2};
  EXPECT_FALSE(built().light.has_value());
  view.geometry.slice.reset();
  EXPECT_TRUE(built().light.has_value());
  view.light.reset();
  EXPECT_FALSE(built().light.has_value());
}

TEST_F(LightOfAView, BelowTheHorizonIsAmbientAndNeedsNoVolume) {
  view.light->elevation = -1;
  const auto scene = built();
  EXPECT_EQ(scene.light->strength, 0);
  EXPECT_EQ(scene.light->sunlight, nullptr);
}

TEST_F(LightOfAView, AtTheHorizonIsThatOfTheLimit) {
  view.light->elevation = 0;
  const auto level = built();
  view.light->elevation = 1e-6;
  const auto above = built();
  EXPECT_GT(level.light->strength, 0);
  ASSERT_NE(level.light->sunlight, nullptr);
  ASSERT_NE(above.light->sunlight, nullptr);
  for (std::size_t n = 0; n < level.light->sunlight->size(); ++n) {
    ASSERT_NEAR((*level.light->sunlight)[n], (*above.light->sunlight)[n], 2);
  }
}

// The light of the lowest samples is the mean above and below them.
TEST_F(LightOfAView, OnTheGroundHasPassedTheLowestCellsWhole) {
  view.light->elevation = 90;
  view.light->ambient = 0;
  view.light->shadows = 20;
  view.ground.show = protocol::GroundShow::on;
  const auto scene = built();
  ASSERT_TRUE(scene.body && scene.body->light);
  const auto& at = scene.lattice.positions;
  double most = 0;
  for (std::size_t n = 0; n < at[0].size() * at[1].size(); ++n) {
    const glm::dvec3 place(at[0][n % at[0].size()], at[1][n / at[0].size()], scene.body->height);
    const double sample = (*scene.light->sunlight)[n] / scene::full_factor;
    const double ground = scene.body->light->factor(place) / scene.light->strength;
    EXPECT_LE(ground, sample + 2e-5);
    most = std::max(most, sample - ground);
  }
  EXPECT_GT(most, 0.01);
}

// Below a sun overhead the optical depth is the sum over the layers of cells, by the law of Beer
// and Lambert.
TEST_F(LightOfAView, OnTheGroundIsThatOfTheColumnAbove) {
  view.light->elevation = 90;
  view.light->ambient = 0;
  view.light->brightness = 1;
  view.ground.show = protocol::GroundShow::on;
  const auto scene = built();
  ASSERT_TRUE(scene.body && scene.body->light);
  const auto& [x, y, z] = scene.lattice.positions;
  const std::vector<float> extinctions =
      light::extinctions(scene.lattice, scene.scalars, scene.light->shadows);
  const std::size_t columns = x.size() * y.size();
  double least = 1;
  for (std::size_t n = 0; n < columns; ++n) {
    double depth = 0;
    double bottom = scene.lattice.box_min.z;
    for (std::size_t k = 0; k < z.size(); ++k) {
      const double top = k + 1 < z.size() ? 0.5 * (z[k] + z[k + 1]) : scene.lattice.box_max.z;
      depth += static_cast<double>(extinctions[k * columns + n]) * (top - bottom);
      bottom = top;
    }
    const glm::dvec3 place(x[n % x.size()], y[n / x.size()], scene.body->height);
    EXPECT_NEAR(scene.body->light->factor(place), std::exp(-depth), 1e-4) << n;
    least = std::min(least, std::exp(-depth));
  }
  EXPECT_LT(least, 0.5) << "no clouds";
}

// Noon at the equator on the day of an equinox.
TEST_F(LightOfAView, StandsWhereTheSunIsAtATimeAndPlace) {
  view.light->sun_at = protocol::SunAtView{"2024-03-20T12:07:00Z", 0, 0};
  EXPECT_GT(built().light->sun.z, 0.999);
  view.light->sun_at->longitude = 180;
  EXPECT_EQ(built().light->strength, 0);
  // A globe is lit from one direction: longitude 0 faces -y.
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  const auto globe = built();
  EXPECT_LT(globe.light->sun.y, -0.999);
  EXPECT_GT(globe.light->strength, 0);
  EXPECT_NE(globe.light->sunlight, nullptr);
}

}  // namespace
}  // namespace windsplat::test
