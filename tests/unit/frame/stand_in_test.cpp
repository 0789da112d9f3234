// What is drawn while the part that a view wants is not resident.
#include "server/scene/level/stand_in.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/build.hpp"
#include "server/scene/detail.hpp"
#include "server/scene/level/choice.hpp"
#include "server/scene/level/parts.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/unit/frame/part_store.hpp"

namespace windsplat::frame {
namespace {

using namespace of_store;  // NOLINT(google-build-using-namespace)
using scene::DrawnPart;
using scene::StandIn;
using scene::Substitute;

constexpr std::array<int, 3> coarsest{levels - 1, levels - 1, levels - 1};

std::optional<Substitute> substitute(const scene::CompletedView& completed,
                                     const data::Dataset& dataset) {
  return scene::stand_in_for(completed, scene::part_of(completed, dataset), dataset);
}

void load_level(data::Dataset& dataset, const std::string& field,
                const scene::CompletedView& completed, int halvings, std::size_t step = 0) {
  const std::array<int, 3> level{halvings, halvings, halvings};
  data::Coarsening how = scene::coarsening_of(completed.lattice(), level);
  if (field == "wind") how = scene::drawn(how, completed.view());
  ASSERT_TRUE(dataset.level(field, step, how));
}

void load_box(data::Dataset& dataset, const scene::CompletedView& completed, int halvings,
              const data::Box& box, const std::string& field = "cloud") {
  auto how = scene::coarsening_of(completed.lattice(), {halvings, halvings, halvings});
  if (field == "wind") how = scene::drawn(how, completed.view());
  const auto part = scene::part_of_field(dataset, {field, how}, {box, nullptr});
  ASSERT_TRUE(dataset.derived(field, 0, part.value()));
}

data::Box sight(const scene::CompletedView& completed, int halvings) {
  const std::array<int, 3> level{halvings, halvings, halvings};
  const auto quantum = scene::least_quantum(completed.view(), dims, level, false);
  return scene::box_in_sight(completed.view(), completed.camera(), completed.lattice(), level,
                             quantum);
}

TEST(StandIn, IsTheFinestResidentThatHoldsWhatIsInSight) {
  data::Dataset tight = store(samples_bytes / 2);
  const auto completed = scene::complete(of_one_voxel(), tight).value();
  const DrawnPart wanted = scene::part_of(completed, tight);
  ASSERT_TRUE(wanted.held);
  EXPECT_FALSE(substitute(completed, tight));
  load_level(tight, "cloud", completed, levels - 1);
  auto found = substitute(completed, tight);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->part.halvings, coarsest);
  EXPECT_EQ(found->part.wanted, wanted.wanted);
  EXPECT_EQ(found->missing_bytes, wanted.held->samples() * sizeof(float));
  load_level(tight, "cloud", completed, 2);
  EXPECT_EQ(substitute(completed, tight)->part.halvings, (std::array{2, 2, 2}));

  // A part that is not all in sight, and one that is and has more.
  data::Box box = sight(completed, 1);
  box.first[0] += 8;
  box.count[0] = std::min(box.count[0], 45 - box.first[0]);
  load_box(tight, completed, 1, box);
  EXPECT_EQ(substitute(completed, tight)->part.halvings, (std::array{2, 2, 2}));
  box = sight(completed, 1);
  box.count[2] = 31 - box.first[2];
  load_box(tight, completed, 1, box);
  found = substitute(completed, tight);
  EXPECT_EQ(found->part.halvings, (std::array{1, 1, 1}));
  EXPECT_EQ(found->part.held->box, box);
  EXPECT_GT(found->missing_bytes, 0U);

  ASSERT_TRUE(scene::build_scene(completed, tight));
  EXPECT_FALSE(substitute(completed, tight)) << "nothing stands in for what is resident";
}

TEST(StandIn, WhereNothingIsResidentALevelThatTakesLittleIsLoadedFirst) {
  data::Dataset tight = store(samples_bytes / 2);
  const auto completed = scene::complete(of_one_voxel(), tight).value();
  const DrawnPart wanted = scene::part_of(completed, tight);
  const auto base = scene::base_for(completed, wanted, tight);
  ASSERT_TRUE(base);
  const auto first = scene::build_scene(completed, tight, StandIn::allowed).value();
  EXPECT_EQ(first.level, base->part.halvings);
  EXPECT_GT(first.level, wanted.halvings);
  EXPECT_EQ(first.missing_bytes, wanted.held->samples() * sizeof(float));
  EXPECT_LT(tight.resident_bytes(), first.missing_bytes);
  const auto final = scene::build_scene(completed, tight).value();
  EXPECT_EQ(final.level, wanted.halvings);
  EXPECT_FALSE(scene::base_for(completed, wanted, tight)) << "what is wanted is resident";
}

TEST(StandIn, AnotherPartOfTheLevelMissesNothing) {
  data::Dataset tight = store(samples_bytes / 2);
  const auto completed = scene::complete(of_one_voxel(), tight).value();
  const data::Box narrow = sight(completed, 0);
  ASSERT_NE(narrow, scene::part_of(completed, tight).held->box);
  load_box(tight, completed, 0, narrow);
  data::Dataset resident = tight.resident_only();
  const auto drawn = scene::build_scene(completed, resident, StandIn::allowed).value();
  EXPECT_EQ(drawn.lattice.held(), narrow);
  EXPECT_EQ(drawn.missing_bytes, 0U);
  const auto final = scene::build_scene(completed, tight).value();
  EXPECT_NE(final.lattice.held(), narrow);
  EXPECT_EQ(test::render(drawn).image.rgba, test::render(final).image.rgba);
}

protocol::View along_diagonal(double x) {
  protocol::View view = of_one_voxel();
  view.camera.target = {x, 0, 0.05};
  view.camera.eye = {x + 1.2, -1.6, 0.95};
  view.method.detail = protocol::Detail::full;
  return view;
}

TEST(StandIn, BoxesOfAGridThatHoldAllInSightStandIn) {
  data::Dataset tight = store(samples_bytes / 2);
  const auto first = scene::complete(along_diagonal(0.1), tight).value();
  const auto drawn = scene::build_scene(first, tight).value();
  ASSERT_TRUE(drawn.lattice.part && drawn.lattice.part->grid);
  // A little nearer, so that fewer boxes are in sight.
  protocol::View nearer = along_diagonal(0.1);
  nearer.camera.height = 1e-4;
  nearer.method.detail = protocol::Detail::automatic;
  const auto second = scene::complete(nearer, tight).value();
  DrawnPart wanted = scene::part_of(second, tight);
  ASSERT_TRUE(wanted.held && wanted.held->grid);
  // Not in memory: all samples of the bounds.
  wanted.held->grid = nullptr;
  auto found = scene::stand_in_for(second, wanted, tight);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->part.held, drawn.lattice.part);
  EXPECT_EQ(found->missing_bytes, 0U);
  protocol::View steeper = along_diagonal(0.1);
  steeper.camera.eye = protocol::Vec3{1.1, -1.6, 0.95};
  const auto beside = scene::complete(steeper, tight).value();
  const auto needed = scene::part_of(beside, tight).held.value();
  const data::Box& bounds = drawn.lattice.part->box;
  for (std::size_t a = 0; a < 3; ++a) {
    ASSERT_GE(needed.box.first[a], bounds.first[a]);
    ASSERT_LE(needed.box.first[a] + needed.box.count[a], bounds.first[a] + bounds.count[a]);
  }
  EXPECT_FALSE(substitute(beside, tight)) << "other boxes are in sight";
}

TEST(StandIn, IsOfAllFieldsAtTheStepOfTheView) {
  data::Dataset tight = store(samples_bytes);
  protocol::View view = of_one_voxel();
  view.vector.field.name = "wind";
  view.vector.field.kind = protocol::FieldChoice::Kind::named;
  view.vector.stride = 4;
  const auto completed = scene::complete(view, tight).value();
  load_level(tight, "cloud", completed, levels - 1, 1);
  load_level(tight, "wind", completed, levels - 1, 1);
  EXPECT_FALSE(substitute(completed, tight)) << "of another step";
  load_level(tight, "cloud", completed, levels - 1);
  EXPECT_FALSE(substitute(completed, tight)) << "without the other field";
  view.vector.stride = 2;
  load_level(tight, "wind", scene::complete(view, tight).value(), levels - 1);
  EXPECT_FALSE(substitute(completed, tight)) << "lines of another stride";
  load_level(tight, "wind", completed, levels - 1);
  load_box(tight, completed, 2, sight(completed, 2), "wind");
  ASSERT_TRUE(substitute(completed, tight));
  EXPECT_EQ(substitute(completed, tight)->part.halvings, coarsest);
  load_box(tight, completed, 2, sight(completed, 2));
  EXPECT_EQ(substitute(completed, tight)->part.halvings, (std::array{2, 2, 2}));
}

TEST(StandIn, IsNotAPartThatBeginsWithinAKernel) {
  data::Dataset tight = store(samples_bytes / 2);
  protocol::View view = of_one_voxel();
  view.scalars->front().stride = 3;
  const auto strided = scene::complete(view, tight).value();
  data::Box box = sight(strided, 0);
  ASSERT_GT(box.first[0], 0);
  box.first[0] -= 8;
  box.count[0] += 8;
  load_box(tight, strided, 0, box);
  EXPECT_FALSE(substitute(strided, tight));
  view.scalars->front().stride = 1;
  EXPECT_EQ(substitute(scene::complete(view, tight).value(), tight)->part.held->box, box);
}

TEST(StandIn, IsOfFullDetailWhereNoOtherMayBeDrawn) {
  data::Dataset tight = store(samples_bytes / 2);
  protocol::View view = of_one_voxel();
  view.method.detail = protocol::Detail::full;
  const auto completed = scene::complete(view, tight).value();
  load_level(tight, "cloud", completed, levels - 1);
  EXPECT_FALSE(substitute(completed, tight));
  EXPECT_EQ(scene::loads_of(completed, tight).size(), 1U) << "no level that cannot be drawn";
  load_box(tight, completed, 0, sight(completed, 0));
  EXPECT_TRUE(substitute(completed, tight));
}

TEST(StandIn, ALevelThatTakesLittleIsLoadedFirst) {
  data::Dataset tight = store(samples_bytes / 2);
  const auto completed = scene::complete(of_one_voxel(), tight).value();
  const auto loads = scene::loads_of(completed, tight);
  ASSERT_EQ(loads.size(), 2U);
  ASSERT_TRUE(tight.derived(loads[0].field, 0, loads[0].how));
  EXPECT_EQ(substitute(completed, tight)->part.halvings, coarsest);
  ASSERT_TRUE(tight.derived(loads[1].field, 0, loads[1].how));
  data::Dataset resident = tight.resident_only();
  EXPECT_TRUE(scene::build_scene(completed, resident)) << "what is wanted";

  // 23 x 19 x 16 samples of 20 bytes are 0.140 MB, a tenth of the limit 0.148 MB.
  data::Dataset wide = store(samples_bytes * 9 / 10);
  ASSERT_TRUE(wide.derived(scene::loads_of(completed, wide)[0].field, 0,
                           scene::loads_of(completed, wide)[0].how));
  EXPECT_EQ(substitute(completed, wide)->part.halvings, (std::array{2, 2, 2}));
}

// Also of those that are computed and not stored, as their axes are halved one by one.
TEST(StandIn, WhatIsLoadedFirstStandsInForEveryLevel) {
  int computed = 0;
  int stored = 0;
  for (int n = 0; n < 60; ++n) {
    data::Dataset wide = store(40 * samples_bytes, true);  // all levels take little
    protocol::View view = of_one_voxel();
    view.camera.height = 0.5 + 0.1 * n;
    const auto completed = scene::complete(view, wide).value().coarsened(n % 3);
    const auto loads = scene::loads_of(completed, wide);
    if (loads.size() < 2) continue;
    const auto& levels_there = wide.info().stored->levels;
    const auto wanted = scene::part_of(completed, wide).halvings;
    const bool is_stored =
        std::find(levels_there.begin(), levels_there.end(), wanted) != levels_there.end();
    (is_stored ? stored : computed) += 1;
    ASSERT_TRUE(wide.derived(loads[0].field, 0, loads[0].how));
    EXPECT_TRUE(substitute(completed, wide)) << n;
  }
  EXPECT_GT(stored, 3);
  EXPECT_GT(computed, 3);
}

TEST(StandIn, NoLevelIsLoadedFirstThatTakesMuch) {
  data::Dataset tight = store(samples_bytes);
  protocol::View view = of_one_voxel();
  view.vector.field.name = "wind";
  view.vector.field.kind = protocol::FieldChoice::Kind::named;
  view.vector.length = 0.001;
  view.vector.stride = 2;  // middles of kernels have 3/8 of the bytes of all samples of the cloud
  EXPECT_EQ(scene::loads_of(scene::complete(view, tight).value(), tight).size(), 2U);
  view.vector.stride = 8;
  EXPECT_EQ(scene::loads_of(scene::complete(view, tight).value(), tight).size(), 4U);
}

TEST(StandIn, LightSurfacesAndDataWithoutLevelsHaveNone) {
  data::Dataset tight = store(samples_bytes / 2);
  protocol::View view = of_one_voxel();
  view.light.emplace();
  const auto completed = scene::complete(view, tight).value();
  load_level(tight, "cloud", completed, levels - 1);
  EXPECT_FALSE(substitute(completed, tight));
  EXPECT_TRUE(scene::loads_of(completed, tight).empty());
}

// Moving frames are drawn from what earlier views left, final ones have the bits of a new dataset.
TEST(StandIn, FinalFramesDoNotDependOnTheHistoryOfCameras) {
  Random random(11);
  int stood_in = 0, parts = 0, finals = 0;
  for (int history = 0; history < 12; ++history) {
    const std::uint64_t bytes = samples_bytes * static_cast<std::uint64_t>(1 + history % 3) / 2;
    data::Dataset used = store(bytes);
    data::Dataset resident = used.resident_only();
    protocol::View view = random_view(random);
    for (int n = 0; n < 17; ++n) {
      const protocol::View other = random_view(random);
      view.camera = other.camera;
      view.image = other.image;
      const auto completed = scene::complete(view, used);
      ASSERT_TRUE(completed) << completed.error().message;
      const auto loads = scene::loads_of(*completed, used);
      if (loads.empty()) break;
      (void)used.derived(loads[0].field, 0, loads[0].how);
      if (const auto moving = scene::build_scene(*completed, resident, StandIn::allowed)) {
        (void)test::render(*moving);
        stood_in += moving->missing_bytes > 0 ? 1 : 0;
        parts += moving->missing_bytes > 0 && moving->lattice.part ? 1 : 0;
      }
      if (random.below(2) == 0) continue;
      data::Dataset fresh = store(bytes);
      const auto wanted = scene::build_scene(*completed, fresh);
      if (!wanted) continue;  // does not fit
      const auto final = scene::build_scene(*completed, used);
      ASSERT_TRUE(final) << final.error().message;
      EXPECT_EQ(final->missing_bytes, 0U);
      EXPECT_EQ(final->lattice.part, wanted->lattice.part);
      ASSERT_EQ(test::render(*final).image.rgba, test::render(*wanted).image.rgba) << history;
      ++finals;
    }
  }
  EXPECT_GT(stood_in, 20);
  EXPECT_GT(parts, 2);
  EXPECT_GT(finals, 40);
}

}  // namespace
}  // namespace windsplat::frame
