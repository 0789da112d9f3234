// The grid of the sunlight of a curved lattice: found once, and not for a request that has ended.
#include "server/light/kept_grid.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>

#include "server/base/cancel.hpp"
#include "server/data/samples/samples.hpp"
#include "server/scene/build.hpp"

namespace windsplat::light {
namespace {

TEST(KeptGrid, IsRememberedForAllStepsMediaAndSunsOfALattice) {
  auto source = data::open_sample("climate", {24, 16, 6}, 2);
  data::Dataset dataset(std::move(*source), "climate", 64U << 20U);
  protocol::View view;
  view.dataset = "climate";
  view.geometry.mapping = protocol::GeometryMapping::sphere;
  view.light.emplace();
  const auto scene_of = [&] { return scene::build_scene(view, dataset).value(); };
  const scene::Scene first = scene_of();
  CancelToken ended;
  ended.cancel();
  // Of another dataset handle, so that nothing is remembered yet.
  auto again = data::open_sample("climate", {24, 16, 6}, 2);
  data::Dataset fresh(std::move(*again), "climate", 64U << 20U);
  data::Dataset cancelled = fresh.cancelled_by(ended);
  const auto none = kept_grid(view.geometry, first, cancelled);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::cancelled);
  const auto found = kept_grid(view.geometry, first, fresh);
  ASSERT_TRUE(found);
  // What is remembered needs no pass, which would be cancelled.
  view.step = 1;
  view.light->azimuth = 77;
  view.region.where.push_back({"cloud", {0.1, 1}, protocol::FilterOf::media});
  const auto kept = kept_grid(view.geometry, scene_of(), cancelled);
  ASSERT_TRUE(kept);
  for (std::size_t a = 0; a < 3; ++a) EXPECT_EQ(kept->positions[a], found->positions[a]);
  view.geometry.scale = {1, 1, 2};
  EXPECT_FALSE(kept_grid(view.geometry, scene_of(), cancelled)) << "another lattice";
}

}  // namespace
}  // namespace windsplat::light
