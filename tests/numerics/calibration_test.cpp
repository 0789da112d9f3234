// Forecast errors of frames compared with their true errors, at viewpoints without measurements.
#include "server/study/calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

#include "server/data/resident/dataset.hpp"
#include "server/data/samples/samples.hpp"
#include "server/engine/reference/reference.hpp"

namespace windsplat::study {
namespace {

Subject small_tornado() {
  auto source = data::open_sample("tornado", {32, 32, 32}, 1);
  if (!source) throw std::runtime_error(source.error().message);
  auto dataset = std::make_shared<data::Dataset>(std::move(*source), "tornado", 1ULL << 30);
  protocol::View view;
  view.dataset = "tornado";
  return make_subject("tornado", dataset, view, {48, 36}).value();
}

// Two calibrated and three held-out viewpoints of each of five scenes.
const Calibration& calibrated() {
  static const Calibration made = [] {
    ThreadPool pool(2);
    const CancelToken cancel;
    const Truth integral = [&](const scene::Scene& scene) -> Result<Picture> {
      auto picture = engine::reference::render(scene, pool, cancel, {1e-7});
      if (!picture) return picture.error();
      return Picture{picture->width, picture->height, std::move(picture->rgba), 0, 0};
    };
    return calibrate(small_tornado(), {192, 144, 2, 3}, integral, pool, cancel, {}).value();
  }();
  return made;
}

TEST(Calibration, EstimatesAreWithinAFactorOfTwoForNineInTenHeldOutViews) {
  const Agreement told = agreement(calibrated());
  EXPECT_GT(told.count, 150U);
  EXPECT_GE(told.within_two, 0.9);
  EXPECT_GT(told.median, 0.8);
  EXPECT_LT(told.median, 1.25);
}

TEST(Calibration, NineteenInTwentyKeepTheRequestedBound) {
  EXPECT_GE(agreement(calibrated()).bounded, 0.95);
}

TEST(Calibration, CalibrationRunsImproveEstimates) {
  EXPECT_GT(agreement(calibrated()).within_two, agreement_of_priors(calibrated()).within_two);
}

TEST(Calibration, MeasuredErrorsMatchTheReference) {
  const Agreement measured = agreement_of_measured(calibrated());
  EXPECT_EQ(measured.count, 2U * 5 * 3);
  EXPECT_GE(measured.within_two, 0.95);
  EXPECT_NEAR(measured.median, 1, 0.1);
}

TEST(Calibration, JpegErrorsAreWithinAFactorOfTwoAfterOneMeasurement) {
  EXPECT_GE(agreement_of_encodings(calibrated()).within_two, 0.85);
}

// Two independent computations of the reference; one is the integral.
TEST(Calibration, ReferenceEqualsTheIntegral) {
  ASSERT_EQ(calibrated().checks.size(), 5U);
  for (const TruthCheck& check : calibrated().checks) {
    EXPECT_LT(check.apart, 5e-5) << calibrated().variants[check.variant];
  }
}

}  // namespace
}  // namespace windsplat::study
