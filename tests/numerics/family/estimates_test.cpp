// Estimated errors of data that the laws were not fitted to, against measured ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "server/frame/content.hpp"
#include "server/frame/measure.hpp"
#include "server/quality/laws.hpp"
#include "server/quality/table.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/numerics/family/family.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

constexpr double judged_above = 1e-4;

struct Estimated {
  double measured = 0;
  double estimated = 0;
  double learned = 0;  // after a calibration run at another viewpoint of the scene
};

// Two viewpoints of a scene of lines, of a medium and of both; the second one is judged.
const std::vector<Estimated>& judged() {
  static const std::vector<Estimated> found = [] {
    ThreadPool pool(2);
    const CancelToken cancel;
    frame::Workspace workspace;
    std::vector<Estimated> out;
    for (const FamilyMember& member : strangers()) {
      const auto dataset = formula_dataset(member.field, member.formula);
      for (std::uint32_t scene = 30; scene < 33; ++scene) {
        std::optional<quality::Table> table;
        for (std::uint32_t viewpoint = 0; viewpoint < 2; ++viewpoint) {
          const auto completed =
              scene::complete(random_view(*dataset, scene, viewpoint, 240), *dataset).value();
          if (!table) table.emplace(quality::signature_of(completed.view()).kind);
          const quality::Table untaught(quality::signature_of(completed.view()).kind);
          std::vector<frame::CalibrationSample> samples;
          const auto done = frame::calibrate(completed, *dataset, pool, cancel, workspace,
                                             [&](const auto& one) { samples.push_back(one); });
          EXPECT_TRUE(done);
          for (const frame::CalibrationSample& one : samples) {
            if (viewpoint == 0) {
              table->add(one.setting, one.viewpoint, one.measured);
            } else {
              out.push_back({*one.measured.error,
                             untaught.forecast(one.setting, one.viewpoint).error,
                             table->forecast(one.setting, one.viewpoint).error});
            }
          }
        }
      }
    }
    return out;
  }();
  return found;
}

// The share of estimates within a factor of the measured error.
template <class Estimate>
double share_within(double factor, const Estimate& estimate) {
  double count = 0;
  double within = 0;
  for (const Estimated& one : judged()) {
    if (one.measured <= judged_above) continue;
    count += 1;
    within += std::abs(std::log(estimate(one) / one.measured)) <= std::log(factor) ? 1 : 0;
  }
  EXPECT_GT(count, 60);
  return within / count;
}

TEST(Estimates, AreWithinAFactorOfTwoOnThreeInFourFramesOfOtherData) {
  EXPECT_GE(share_within(2, [](const Estimated& one) { return one.estimated; }), 0.75);
  EXPECT_GE(share_within(4, [](const Estimated& one) { return one.estimated; }), 0.97);
}

TEST(Estimates, LearnFromTheFirstCalibrationRunOfOtherData) {
  EXPECT_GE(share_within(2, [](const Estimated& one) { return one.learned; }), 0.8);
}

TEST(Estimates, NoErrorIsBelowThatOfSinglePrecision) {
  double least = 1;
  for (const Estimated& one : judged()) {
    least = std::min({least, one.measured, one.estimated, one.learned});
  }
  EXPECT_GE(least, quality::error_least);
}

// Also where the view merges samples, whose means are computed when the run needs them.
TEST(Estimates, CalibrationRunsKnowWhatTheirViewsShow) {
  const FamilyMember member = strangers()[0];
  const auto dataset = formula_dataset(member.field, member.formula);
  protocol::View view = random_view(*dataset, 32, 0, 161);
  const auto near = scene::complete(view, *dataset).value();
  scene::orbit(view, near.lattice(), 30, 20, 0.1);
  const auto far = scene::complete(view, *dataset).value();
  ASSERT_LT(scene::detail_shown(far), 1) << "merges samples";
  ThreadPool pool(2);
  const CancelToken cancel;
  frame::Workspace workspace;
  int count = 0;
  const auto done = frame::calibrate(far, *dataset, pool, cancel, workspace, [&](const auto& one) {
    EXPECT_TRUE(one.viewpoint.content);
    ++count;
  });
  EXPECT_TRUE(done);
  EXPECT_GT(count, 5);
}

// Twice the extinction is twice the optical depth of a cell and of the rays; lengths are in heights
// of the picture, so that its size makes no difference.
TEST(Content, FollowsExtinctionAndNotTheSizeOfThePicture) {
  const FamilyMember member = strangers()[0];
  const auto dataset = formula_dataset(member.field, member.formula);
  protocol::View view = random_view(*dataset, 31, 0);
  const auto content = [&] {
    const auto completed = scene::complete(view, *dataset).value();
    return frame::content_of(scene::build_scene(completed, *dataset).value());
  };
  for (auto& point : *view.scalars->front().extinction) point[1] *= 1e-4;
  const quality::Content thin = content();
  for (auto& point : *view.scalars->front().extinction) point[1] *= 2;
  const quality::Content twice = content();
  EXPECT_NEAR(twice.cell_depth / thin.cell_depth, 2, 1e-3);
  EXPECT_NEAR(twice.depth / thin.depth, 2, 1e-2);
  EXPECT_NEAR(twice.step / thin.step, 2, 1e-2);
  EXPECT_NEAR(twice.cell, thin.cell, 1e-6);
  view.image.width *= 2;
  view.image.height *= 2;
  const quality::Content large = content();
  EXPECT_NEAR(large.cell / twice.cell, 1, 1e-6);
  EXPECT_NEAR(large.step / twice.step, 1, 1e-6);
}

// Layers of terrain may coincide in some columns, so that edges of cells have no length.
TEST(Content, IsFiniteWhereLayersCoincide) {
  const FamilyMember member = strangers()[0];
  const auto dataset = formula_dataset(member.field, member.formula);
  const auto completed = scene::complete(random_view(*dataset, 31, 0), *dataset).value();
  scene::Scene scene = scene::build_scene(completed, *dataset).value();
  const auto& [nx, ny, nz] = scene.lattice.dims;
  ASSERT_GT(nz, 3);
  auto places = std::make_shared<std::vector<std::array<float, 3>>>();
  for (int n = 0; n < nx * ny * nz; ++n) {
    const int k = n / (nx * ny);
    const bool joined = n % nx < nx / 2;
    const auto at = [&](int axis, int i) {
      return static_cast<float>(scene.lattice.positions[axis][static_cast<std::size_t>(i)]);
    };
    places->push_back({at(0, n % nx), at(1, n / nx % ny), at(2, joined ? k / 2 * 2 : k)});
  }
  scene.lattice.places = places;
  const quality::Content content = frame::content_of(scene);
  for (const double value : {content.lines, content.shade, content.line_depth, content.depth,
                             content.cell_depth, content.tint, content.cell, content.step,
                             content.bend, content.wide_bend, content.order, content.step_cell}) {
    EXPECT_TRUE(std::isfinite(value)) << value;
  }
  EXPECT_GT(content.step, 0);
}

// At a step of the extinction a value has that of the second point, as in pictures.
TEST(Content, AValueAtAStepIsAsDenseAsItIsDrawn) {
  const FamilyMember member = strangers()[0];
  const auto dataset = formula_dataset(member.field, member.formula);
  const auto completed = scene::complete(random_view(*dataset, 31, 0), *dataset).value();
  scene::Scene scene = scene::build_scene(completed, *dataset).value();
  ASSERT_EQ(scene.scalars.size(), 1U);
  scene::ScalarLayer& layer = scene.scalars.front();
  layer.field = make_volume(scene.lattice, 1, [](int, double, double, double) { return 1.0F; });
  layer.extinction = {{1, 0}, {1, 10}};
  const quality::Content at_step = frame::content_of(scene);
  layer.extinction = {{0, 10}, {2, 10}};
  const quality::Content dense = frame::content_of(scene);
  EXPECT_GT(dense.cell_depth, 0);
  EXPECT_DOUBLE_EQ(at_step.cell_depth, dense.cell_depth);
  EXPECT_DOUBLE_EQ(at_step.depth, dense.depth);
}

}  // namespace
}  // namespace windsplat::test
