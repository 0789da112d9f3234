// Estimates of views unlike those that the laws are fitted to, against measured errors.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/frame/content.hpp"
#include "server/frame/difference.hpp"
#include "server/frame/measure.hpp"
#include "server/quality/laws.hpp"
#include "server/quality/table.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/numerics/family/family.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

constexpr double whole_turn = 6.283185307179586;

Values waves(const Point& at, const std::array<int, 3>&) {
  const double a = std::sin(whole_turn * (1.4 * at[0] + 0.9 * at[1]) + 1.1);
  const double b = std::cos(whole_turn * (1.2 * at[1] - 1.6 * at[2]) + 2 * at[0]);
  return {{9 * a, 7 * b, 3}, 0.5 + 0.4 * a * b};
}

struct Ratios {
  int compared = 0;
  int within = 0;  // a factor of 2
  double least = 1e30;

  void add(double estimate, double error) {
    constexpr double judged_above = 1e-4;
    if (error <= judged_above) return;
    ++compared;
    within += std::abs(std::log(estimate / error)) <= std::log(2) ? 1 : 0;
    least = std::min(least, estimate / error);
  }
};

// Estimates without measurements of the settings of one cause, against a calibration run.
Ratios ratios_of(const scene::CompletedView& completed, data::Dataset& dataset,
                 quality::Cause cause) {
  ThreadPool pool(2);
  frame::Workspace workspace;
  const quality::Table untaught(quality::signature_of(completed.view()).kind);
  Ratios out;
  const auto done = frame::calibrate(
      completed, dataset, pool, {}, workspace, [&](const frame::CalibrationSample& one) {
        if (quality::cause_of(quality::settings[one.setting], one.viewpoint) != cause) return;
        out.add(untaught.forecast(one.setting, one.viewpoint).error, *one.measured.error);
      });
  EXPECT_TRUE(done);
  return out;
}

// The medium of a sheet is crossed along the axis of one sample.
TEST(OddViews, SmallerPicturesOfSheetsAreEstimated) {
  Ratios all;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    TrialField field{"sheet", {36, 32, 28}, {1e3, 900, 800}};
    field.dims[axis] = 1;
    field.extent_m[axis] = 40;
    const auto dataset = formula_dataset(field, waves);
    for (std::uint32_t viewpoint = 0; viewpoint < 3; ++viewpoint) {
      const auto view = random_view(*dataset, 901, viewpoint, 320);  // a medium alone
      const auto found =
          ratios_of(scene::complete(view, *dataset).value(), *dataset, quality::Cause::smaller);
      all.compared += found.compared;
      all.within += found.within;
      all.least = std::min(all.least, found.least);
    }
  }
  EXPECT_GE(all.compared, 15);
  EXPECT_GE(all.within, 0.75 * all.compared);
  EXPECT_GT(all.least, 0.25);
}

// Rays at the edge of a wide picture cross many cells within the depth of one. In a medium of one
// colour no order of kernels makes a difference.
TEST(OddViews, RaysAtASlantAreTriedInPiecesOfACell) {
  scene::Scene scene = cloudy_scene(16, 240);
  scene.vector.reset();
  const auto block = [](int, double x, double, double) { return x < 0.3 ? 4.0F : 0.0F; };
  scene.scalars = {medium(make_volume(scene.lattice, 1, block), {0.5F, 0.6F, 0.9F})};
  scene.camera = look({0, -1.2, 0}, {0, 1, 0}, 0.2, 240, 16, true, 0.5);
  scene.method = scene::Method::kernel;
  const engine::Image drawn = render(scene, 2).image;
  scene.method = scene::Method::slab;
  scene.slab_thickness = 0.0625;
  const engine::Image truth = render(scene, 2).image;
  EXPECT_LT(frame::difference_of(drawn.rgba, truth.rgba).rmse, 2e-5);
  const double tried = frame::content_of(scene)->trials->kernel;
  EXPECT_LT(tried, 1e-4);
}

// Every sample is behind the eye, and kernels of some are before it. Without the light of samples
// merged and smaller pictures would be estimated to be nearly exact.
TEST(OddViews, WhereNoSampleIsSeenContentIsThatOfTheCellsAtTheEye) {
  scene::Scene scene = cloudy_scene(12, 100);
  scene.vector.reset();
  scene.camera = look({0.1, 0.05, 1.02}, {0.1, 0.05, 1}, 0.1, 110, 90, true, 0.6);
  const auto content = frame::content_of(scene);
  ASSERT_TRUE(content && content->trials);
  ASSERT_GT(content->trials->kernel, 0);
  EXPECT_NEAR(content->cell, 0.5 / 0.6, 1e-9);
  EXPECT_GT(content->bends.back(), 1e-5);
  EXPECT_GT(content->cell_bends[0], 1e-3);
}

}  // namespace
}  // namespace windsplat::test
