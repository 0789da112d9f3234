// Pictures drawn from the part of a level that is in sight, against those of the whole level.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "protocol/view/shown.hpp"
#include "server/data/model/stored.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/frame/cost.hpp"
#include "server/frame/drawn_samples.hpp"
#include "server/frame/empty_picture.hpp"
#include "server/frame/pick/pick.hpp"
#include "server/scene/build.hpp"
#include "server/scene/level/choice.hpp"
#include "server/scene/level/parts.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/unit/frame/part_store.hpp"

namespace windsplat::frame {
namespace {

using namespace of_store;  // NOLINT(google-build-using-namespace)
using scene::Scene;

// The scene of a part, drawn from all samples of its level.
Scene of_whole_level(const Scene& part, const scene::CompletedView& completed,
                     data::Dataset& roomy) {
  Scene whole = part;
  whole.lattice.part.reset();
  const Coarsening how = scene::coarsening_of(completed.lattice(), part.level);
  for (scene::ScalarLayer& layer : whole.scalars)
    layer.field = roomy.level("cloud", 0, how).value();
  if (whole.vector) {
    whole.vector->field = roomy.level("wind", 0, scene::drawn(how, completed.view())).value();
    whole.vector->field_stride = 1;
  }
  return whole;
}

std::vector<float> picture_of(const Scene& scene, engine::WorkReport* work = nullptr) {
  if (scene.method == scene::Method::reference) {
    ThreadPool pool(1);
    const auto truth = engine::reference::render(scene, pool, CancelToken(), {}, {}).value();
    return {truth.rgba.begin(), truth.rgba.end()};
  }
  const engine::Rendered drawn = test::render(scene);
  if (work != nullptr) *work = drawn.work;
  return drawn.image.rgba;
}

double share_of(const Scene& part) {
  double share = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    share *= static_cast<double>(part.lattice.held().count[a]) / part.lattice.dims[a];
  }
  return share;
}

// Of the samples that are drawn of a view at full detail.
std::uint64_t bytes_in_full(const scene::CompletedView& completed, const data::Dataset& dataset) {
  const scene::Lattice& lattice = completed.lattice();
  const Coarsening full = scene::coarsening_of(lattice, {0, 0, 0});
  std::uint64_t bytes = 0;
  for (const scene::ShownField& one : scene::shown_at(completed.view(), full, lattice, dataset)) {
    bytes += dataset.level_bytes(one.field, one.coarsening);
  }
  return bytes;
}

// At every sample of a column of the data.
void look_along_axis(protocol::View& view, std::size_t axis) {
  view.method.detail = protocol::Detail::full;
  view.camera.eye = view.camera.target;
  (*view.camera.eye)[axis] += 1;
  view.camera.fov_y *= 0.3;
  if (view.camera.height) *view.camera.height *= 0.3;
}

// At every sample near a line along a diagonal.
void look_along_diagonal(protocol::View& view) {
  view.method.detail = protocol::Detail::full;
  const auto& at = *view.camera.target;
  view.camera.eye = protocol::Vec3{at[0] + 1.2, at[1] - 1.6, at[2] + 0.9};
  view.camera.fov_y *= 0.1;
  if (view.camera.height) *view.camera.height *= 0.1;
}

struct Tally {
  int parts = 0;
  int middles = 0;        // pictures of boxes of lines drawn from the middles of kernels
  int whole_middles = 0;  // the same of the whole
  int boxes = 0;          // pictures of parts that are several boxes
  int boxed_middles = 0;  // the same of lines drawn from the middles of kernels
  int all_middles = 0;    // pictures of parts with all of these
  int drawn = 0;          // pictures that show something
  std::map<int, int> by_level;
};

// Draws what a memory limit leaves of random views, twice.
void compare(bool uneven, std::uint32_t seed, int views, protocol::MethodName method,
             Tally& tally) {
  Random random(seed);
  data::Dataset roomy = store(100 * samples_bytes, uneven);
  for (int n = 0; n < views; ++n) {
    protocol::View view = random_view(random);
    view.method.name = method;
    const int way = random.below(4);
    if (way < 2) look_along_axis(view, static_cast<std::size_t>(random.below(2)));
    if (way == 2) look_along_diagonal(view);
    if (method == protocol::MethodName::reference) view.image = {12, 9};
    const auto plain = scene::complete(view, roomy);
    ASSERT_TRUE(plain) << plain.error().message;
    const auto completed = plain->coarsened(random.below(3));
    // From a fraction of what is drawn at full detail to more than all of it.
    const double share = std::exp(random.within(std::log(0.1), std::log(2)));
    data::Dataset tight = store(
        static_cast<std::uint64_t>(share * static_cast<double>(bytes_in_full(completed, roomy))),
        uneven);
    const scene::DrawnPart chosen = scene::part_of(completed, tight);
    const bool full = chosen.halvings == std::array{0, 0, 0};
    if (!chosen.held && !full) continue;
    const auto part = scene::build_scene(completed, tight);
    if (!chosen.held && !part) continue;  // does not fit
    ASSERT_TRUE(part) << part.error().message;
    const bool middles = part->vector && part->vector->field_stride > 1;
    if (!chosen.held && !middles) continue;
    const Scene whole = of_whole_level(*part, completed, roomy);
    engine::WorkReport of_part, of_whole;
    const std::vector<float> found = picture_of(*part, &of_part);
    const std::vector<float> wanted = picture_of(whole, &of_whole);
    ASSERT_EQ(found, wanted) << n << " of seed " << seed;
    // Every brick that is not culled is in the part.
    EXPECT_EQ(of_part.samples - of_part.culled, of_whole.samples - of_whole.culled);
    EXPECT_EQ(of_part.skipped_bound, of_whole.skipped_bound);
    EXPECT_EQ(of_part.pixel_updates, of_whole.pixel_updates);
    tally.parts += share_of(*part) < 1 ? 1 : 0;
    const auto shows = [](float v) { return v > 0; };
    const bool any = std::any_of(found.begin(), found.end(), shows);
    tally.drawn += any ? 1 : 0;
    if (any && middles) ++(chosen.held ? tally.middles : tally.whole_middles);
    if (any && chosen.held && chosen.held->grid) {
      ++tally.boxes;
      tally.boxed_middles += middles && !part->vector->holds_all ? 1 : 0;
    }
    if (any && part->vector && part->vector->holds_all) ++tally.all_middles;
    if (any) ++tally.by_level[part->level[0]];
  }
}

TEST(Part, PicturesOfBothMethodsAreThoseOfTheWholeLevel) {
  Tally tally;
  compare(false, 1, 140, protocol::MethodName::kernel, tally);
  compare(true, 2, 140, protocol::MethodName::kernel, tally);
  compare(false, 3, 140, protocol::MethodName::slab, tally);
  compare(true, 4, 140, protocol::MethodName::slab, tally);
  EXPECT_GT(tally.parts, 60);
  EXPECT_GT(tally.drawn, 80);
  EXPECT_GT(tally.middles, 10);
  EXPECT_GT(tally.whole_middles, 20);
  EXPECT_GT(tally.boxes, 40);
  EXPECT_GT(tally.boxed_middles, 1);
  EXPECT_GT(tally.all_middles, 20);
  for (int level = 0; level < levels; ++level) EXPECT_GT(tally.by_level[level], 6) << level;
}

TEST(Part, TheReferenceIsThatOfTheWhole) {
  Tally tally;
  compare(false, 3, 30, protocol::MethodName::reference, tally);
  EXPECT_GT(tally.drawn, 5);
  EXPECT_GT(tally.middles + tally.whole_middles, 2);
}

TEST(Part, AViewOfFewVoxelsHasTheirExactValues) {
  data::Dataset tight = store(samples_bytes / 2);
  data::Dataset roomy = store(100 * samples_bytes);
  const auto completed = scene::complete(of_one_voxel(), tight).value();
  const auto part = scene::build_scene(completed, tight).value();
  EXPECT_EQ(part.level, (std::array{0, 0, 0}));
  ASSERT_TRUE(part.lattice.part);
  EXPECT_FALSE(part.lattice.part->grid) << "all of the box is in sight";
  EXPECT_LT(share_of(part), 0.2);
  const auto picked = pick(part, 20, 15, CancelToken()).value();
  ASSERT_TRUE(picked);
  const auto volume = roomy.volume("cloud", 0).value();
  const auto& [x, y, z] = picked->sample;
  EXPECT_EQ(static_cast<float>(picked->value),
            volume->values[static_cast<std::size_t>((z * dims[1] + y) * dims[0] + x)]);
  const auto whole = of_whole_level(part, completed, roomy);
  EXPECT_EQ(picked->sample, pick(whole, 20, 15, CancelToken()).value()->sample);
}

TEST(Part, AChoiceDoesNotDependOnWhatIsResident) {
  data::Dataset fresh = store(samples_bytes / 2);
  data::Dataset used = store(samples_bytes / 2);
  protocol::View other = of_one_voxel();
  other.camera.eye = {-0.3, -2, 0.05};
  other.camera.target = {-0.3, 0, 0.05};
  ASSERT_TRUE(scene::build_scene(other, used));
  const auto one = scene::build_scene(of_one_voxel(), fresh).value();
  const auto two = scene::build_scene(of_one_voxel(), used).value();
  EXPECT_EQ(one.level, two.level);
  EXPECT_EQ(one.lattice.part, two.lattice.part);
}

TEST(Part, BoxesBeginWithBricksOfEveryStride) {
  Random random(7);
  for (int n = 0; n < 50; ++n) {
    protocol::View view = random_view(random);
    data::Dataset roomy = store(100 * samples_bytes);
    const auto completed = scene::complete(view, roomy).value();
    for (int h = 0; h < levels; ++h) {
      const auto quantum = scene::least_quantum(completed.view(), dims, {h, h, h}, false);
      const data::Box box = scene::box_in_sight(completed.view(), completed.camera(),
                                                completed.lattice(), {h, h, h}, quantum);
      const bool strided = h == 0 && protocol::has_strided_lines(completed.view());
      const int stride = strided ? *completed.view().vector.stride : 1;
      for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_EQ(box.first[a] % (8 * stride), 0);
        const int end = box.first[a] + box.count[a];
        EXPECT_TRUE(end % (8 * stride) == 0 || end == data::halved(dims[a], h)) << end;
      }
    }
  }
}

// A cloud of one layer.
data::Dataset layer_of_cloud(std::uint64_t bytes) {
  data::DatasetInfo info;
  const std::array<int, 3> counts{96, 96, 1};
  for (std::size_t a = 0; a < 3; ++a) {
    info.grid.axes.at(a).name = "xyz"[a];
    for (int n = 0; n < counts.at(a); ++n) info.grid.axes.at(a).coordinates.push_back(n);
  }
  info.fields.resize(1);
  info.fields[0].name = "cloud";
  info.fields[0].components = {"cloud"};
  info.steps.resize(1);
  auto cloud = std::make_shared<data::Volume>();
  cloud->dims = counts;
  cloud->values = std::vector<float>(cloud->samples(), 1.0F);
  finish_volume(*cloud);
  return {test::stored_fields(std::move(info), {std::move(cloud)}, 3), "store", bytes};
}

TEST(Part, OfOneLayerHasItAsItsOnlyBoxAcross) {
  protocol::View view = of_one_voxel();
  view.method.detail = protocol::Detail::full;
  view.camera.eye = {0.1, 0.1, 2};
  view.camera.target = {0.1, 0.1, 0};
  view.camera.up = {0, 1, 0};
  view.camera.height = 0.3;
  // Less than bricks of 16 x 16 take, and enough for boxes of 8 x 8.
  for (const std::uint64_t bytes : {7000, 8000, 10000, 12000}) {
    data::Dataset tight = layer_of_cloud(bytes);
    const auto part = scene::part_of(scene::complete(view, tight).value(), tight);
    if (!part.held) continue;
    EXPECT_EQ(part.held->box.count[2], 1) << bytes;
    return;
  }
  FAIL() << "no part";
}

TEST(Part, StridesWithoutASmallCommonMultipleTakeWholeAxes) {
  protocol::View view = of_one_voxel();
  view.vector.field.name = "wind";
  view.vector.stride = 41;
  // 8 times their least common multiple exceeds the numbers of an int.
  for (const int stride : {64, 63, 59, 55}) {
    view.scalars->push_back(view.scalars->front());
    view.scalars->back().stride = stride;
  }
  const auto quantum = scene::least_quantum(view, dims, {0, 0, 0}, false);
  EXPECT_EQ(quantum, dims);
  data::Dataset tight = store(samples_bytes / 2);
  const auto completed = scene::complete(view, tight).value();
  EXPECT_FALSE(scene::part_of(completed, tight).held);
}

TEST(Part, AnEmptyPictureIsNotExplainedByTheValuesOfAPart) {
  protocol::View view = of_one_voxel();
  view.scalars->front().extinction = {{{100.0, 0.0}, {200.0, 20.0}}};
  const auto why = [&](data::Dataset dataset) {
    const auto completed = scene::complete(view, dataset).value();
    const Scene scene = scene::build_scene(completed, dataset).value();
    return why_empty(scene, completed.view(), dataset, {}, engine::WorkReport(), true);
  };
  EXPECT_NE(why(store(100 * samples_bytes)).find("at every value of"), std::string::npos);
  EXPECT_EQ(why(store(samples_bytes / 2)), "the camera does not show the data");
}

TEST(Part, LightSurfacesAndStreamletsShowTheWhole) {
  protocol::View view = of_one_voxel();
  EXPECT_TRUE(scene::may_use_part(view));
  view.light.emplace();
  EXPECT_FALSE(scene::may_use_part(view));
  view.light.reset();
  view.surfaces.emplace_back();
  EXPECT_FALSE(scene::may_use_part(view));
}

TEST(Part, CostCountsThePart) {
  data::Dataset tight = store(samples_bytes / 2);
  data::Dataset roomy = store(100 * samples_bytes);
  protocol::View view = of_one_voxel();
  view.image = {320, 240};
  view.method.detail = protocol::Detail::full;
  const auto of = [&](data::Dataset& dataset) {
    return cost_of(scene::outline(view, dataset).value(), dataset).kernels;
  };
  const auto outline = scene::outline(view, tight).value();
  ASSERT_TRUE(scene::part_of(outline, tight).held);
  EXPECT_LT(of(tight), 0.9 * of(roomy));
}

TEST(Part, SamplesOfAPartHaveIndicesOfTheWhole) {
  data::Dataset tight = store(samples_bytes / 2);
  const auto part = scene::build_scene(of_one_voxel(), tight).value();
  const DrawnSamples samples(part);
  const data::Box box = part.lattice.held();
  EXPECT_EQ(samples.low(), box.first);
  EXPECT_EQ(samples.count(), static_cast<std::int64_t>(box.samples()));
  EXPECT_EQ(samples.number(box.first), 0U);
  EXPECT_FALSE(samples.contains({box.first[0], box.first[1] - 1, box.first[2]}));
}

TEST(Part, SamplesOfBoxesAreThoseThatAreHeld) {
  protocol::View view = of_one_voxel();
  look_along_diagonal(view);
  data::Dataset tight = store(samples_bytes / 2);
  const auto part = scene::build_scene(view, tight).value();
  const auto& grid = part.lattice.part.value().grid;
  ASSERT_TRUE(grid);
  const DrawnSamples samples(part);
  std::set<Index> found;
  for (std::int64_t n = 0; n < samples.count(); ++n) {
    if (const auto at = samples.at(n)) found.insert(*at);
  }
  std::size_t held = 0;
  for (const data::Box& box : grid->boxes()) {
    held += box.samples();
    for (const int x : {box.first[0], box.first[0] + box.count[0] - 1}) {
      EXPECT_TRUE(found.count({x, box.first[1], box.first[2] + box.count[2] - 1}));
    }
  }
  EXPECT_EQ(found.size(), held);
  EXPECT_EQ(samples.count(), static_cast<std::int64_t>(grid->held) * 16 * 16 * 16);
  // What is left out is no neighbour.
  ASSERT_GT(std::count(grid->places.begin(), grid->places.end(), 0), 0);
  for (const Index& at : found) {
    for (std::size_t a = 0; a < 3; ++a) {
      const auto next = samples.neighbour(at, a, 1);
      EXPECT_TRUE(!next || found.count(*next));
    }
  }
}

}  // namespace
}  // namespace windsplat::frame
