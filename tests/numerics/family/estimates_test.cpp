// Estimated errors of data that the laws were not fitted to, against measured ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "server/frame/measure.hpp"
#include "server/quality/laws.hpp"
#include "server/quality/table.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/numerics/family/family.hpp"

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

}  // namespace
}  // namespace windsplat::test
