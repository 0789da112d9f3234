// Pictures of a region against those of the whole data in which the other samples are masked.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "server/engine/kernels/dispatch.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::MethodName;
using protocol::View;

constexpr std::array<int, 3> dims{24, 18, 8};

using Kept = std::function<bool(int i, int j, int k)>;

// Winds that turn, and a cloud; the samples that are not kept are masked.
std::unique_ptr<data::Dataset> winds(const Kept& kept, data::AxisKind kind) {
  data::Grid grid;
  for (std::size_t a = 0; a < 3; ++a) {
    std::vector<double> at;
    for (int i = 0; i < dims[a]; ++i) at.push_back(i);
    grid.axes[a] = axis(data::AxisKind::cartesian, "km", std::move(at));
  }
  if (kind == data::AxisKind::longitude) {
    for (double& x : grid.axes[0].coordinates) x *= 15;
    for (double& y : grid.axes[1].coordinates) y = 8 * y - 68;
    grid.axes[0].kind = data::AxisKind::longitude;
    grid.axes[0].units = "degrees_east";
    grid.axes[1].kind = data::AxisKind::latitude;
    grid.axes[1].units = "degrees_north";
    grid.axes[2].units = "m";
    grid.axes[2].kind = data::AxisKind::height;
  }
  auto source = std::make_unique<FakeSource>(
      std::move(grid), std::vector{wind_info(), scalar_info("cloud", "1")}, 1);
  source->values = [kept](const std::string& field, std::size_t n) {
    const int i = static_cast<int>(n) % dims[0];
    const int j = static_cast<int>(n) / dims[0] % dims[1];
    const int k = static_cast<int>(n) / dims[0] / dims[1];
    if (!kept(i, j, k)) return std::numeric_limits<double>::quiet_NaN();
    const double value = std::sin(0.7 * i + 0.3 * j) + 0.2 * k;
    return field == "cloud" ? std::max(0.0, value - 0.8) : value;
  };
  return dataset_of(std::move(source));
}

View view_of(MethodName method) {
  View view;
  view.image.width = 160;
  view.image.height = 120;
  view.camera.projection = protocol::Projection::orthographic;
  view.camera.eye = protocol::Vec3{0.6, -3, 1.7};
  view.camera.target = protocol::Vec3{0, 0, 0};
  view.camera.height = 2.2;
  view.method.name = method;
  view.method.detail = protocol::Detail::full;
  view.depth_cue.strength = 0;
  view.vector.length = 0.2;
  view.vector.magnitude_range = {0, 3};
  view.vector.min_magnitude = 0;
  view.vector.color.by = protocol::ColorBy::direction;
  view.scalars.emplace();
  view.scalars->emplace_back().field = "cloud";
  view.scalars->front().color.range = {0, 2};
  view.scalars->front().extinction = {{0, 0}, {2, 8}};
  return view;
}

constexpr std::array methods{MethodName::kernel, MethodName::slab};

// Splats that overlap are composited brick by brick, and slabs are counted from the middle of the
// box: both differ for a part, and change media within the error of either method.
constexpr float media_slack = 0.006F;
constexpr float rounding = 1e-6F;

TEST(RegionPicture, IsThatOfTheWholeDataWithTheOtherSamplesMasked) {
  const auto whole = [](int, int, int) { return true; };
  const auto inner = [](int i, int j, int k) {
    return i >= 5 && i <= 14 && j >= 3 && j <= 12 && k >= 2 && k <= 6;
  };
  for (const bool lines_alone : {true, false}) {
    for (const MethodName method : methods) {
      View view = view_of(method);
      if (lines_alone) view.scalars->clear();
      auto masked = winds(inner, data::AxisKind::cartesian);
      const auto wanted = test::render(built(view, *masked));
      auto all = winds(whole, data::AxisKind::cartesian);
      view.region.x = {5, 14};
      view.region.y = {12, 3};
      view.region.z = {2, 6.2};
      const auto got = test::render(built(view, *all));
      EXPECT_LE(test::largest_difference(got, wanted), lines_alone ? rounding : media_slack);
      EXPECT_EQ(got.work.samples, 10 * 10 * 5) << "what lies outside is not even a sample";
      EXPECT_EQ(wanted.work.samples, 24 * 18 * 8);
      view.vector.jitter.seed = 2;
      const auto other = test::render(built(view, *all));
      EXPECT_GT(test::largest_difference(other, wanted), 0.1F) << "the jitter matters";
    }
  }
}

// Whole bricks are composited in the same order.
TEST(RegionPicture, OfWholeBricksEqualsThatOfTheMaskedDataInEveryPixel) {
  auto masked = winds([](int i, int j, int) { return i >= 8 && i <= 15 && j >= 8 && j <= 15; },
                      data::AxisKind::cartesian);
  auto all = winds([](int, int, int) { return true; }, data::AxisKind::cartesian);
  View view = view_of(MethodName::kernel);
  const auto wanted = test::render(built(view, *masked));
  view.region.x = {8, 15};
  view.region.y = {8, 15};
  EXPECT_LE(test::largest_difference(test::render(built(view, *all)), wanted), rounding);
}

TEST(RegionPicture, TheReferenceFollowsTheSceneToo) {
  View view = view_of(MethodName::reference);
  view.image.width = 60;
  view.image.height = 45;
  auto masked = winds([](int i, int j, int) { return i >= 5 && i <= 9 && j >= 3 && j <= 8; },
                      data::AxisKind::cartesian);
  const auto wanted = test::render(built(view, *masked));
  auto all = winds([](int, int, int) { return true; }, data::AxisKind::cartesian);
  view.region.x = {5, 9};
  view.region.y = {3, 8};
  EXPECT_LE(test::largest_difference(test::render(built(view, *all)), wanted), media_slack);
}

TEST(RegionPicture, FiltersAndPolygonsAreThoseOfMaskedSamples) {
  const protocol::Range range{0.3, 0.9};
  const auto cloud = [](int i, int j, int k) {
    const double value = std::sin(0.7 * i + 0.3 * j) + 0.2 * k;
    return static_cast<double>(static_cast<float>(std::max(0.0, value - 0.8)));
  };
  const auto in_triangle = [](int i, int j) { return j >= 2 && i >= j && i + j <= 20; };
  for (const MethodName method : methods) {
    View view = view_of(method);
    auto masked = winds(
        [&](int i, int j, int k) {
          const double value = cloud(i, j, k);
          return in_triangle(i, j) && value >= range[0] && value <= range[1];
        },
        data::AxisKind::cartesian);
    const auto wanted = test::render(built(view, *masked));
    auto all = winds([](int, int, int) { return true; }, data::AxisKind::cartesian);
    view.region.where = {{"cloud", range, protocol::FilterOf::all}};
    view.region.polygon = {{{{2, 2}, {18, 2}, {10, 10}, {2, 2}}}};
    const auto got = test::render(built(view, *all));
    EXPECT_LE(test::largest_difference(got, wanted), media_slack);
  }
}

TEST(RegionPicture, IsTheSameForAnyNumberOfThreads) {
  auto all = winds([](int, int, int) { return true; }, data::AxisKind::longitude);
  View view = view_of(MethodName::slab);
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  view.region.x = {-40, 70};
  view.region.polygon = {{{{-60, -60}, {60, -60}, {0, 65}, {-60, -60}}}};
  view.region.where = {{"cloud", {0.1, 2}, protocol::FilterOf::lines}};
  const Scene scene = built(view, *all);
  const auto one = test::render(scene, 1);
  EXPECT_EQ(one.image.rgba, test::render(scene, 3).image.rgba);
  EXPECT_GT(test::largest_difference(one, test::render(built(view_of(MethodName::slab), *all))),
            0.1F);
}

// On the globe too: the samples inside have the same cells; those at the sides have end cells.
TEST(RegionPicture, OnAGlobeTheInnerSamplesAreThoseOfTheWhole) {
  View view = view_of(MethodName::kernel);
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  view.vector.color.by = protocol::ColorBy::magnitude;
  view.vector.color.range = {0, 3};
  view.vector.stride = 1;  // others count from the first sample of the region
  const auto inner = [](int i, int j, int) { return i >= 4 && i <= 12 && j >= 6 && j <= 11; };
  auto masked = winds(inner, data::AxisKind::longitude);
  const auto wanted = test::render(built(view, *masked));
  // Two rows and columns more, which are masked.
  view.region.x = {45, 195};
  view.region.y = {-28, 28};
  const auto got = test::render(built(view, *masked));
  EXPECT_LE(test::largest_difference(got, wanted), 1e-5F);
}

}  // namespace
}  // namespace windsplat::scene
