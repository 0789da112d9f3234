// Synthetic forecasts, a budget, an error limit -> the chosen setting.
#include "server/quality/pick.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace windsplat::quality {
namespace {

using protocol::MethodName;

class Pick : public testing::Test {
 protected:
  void SetUp() override {
    view.image.width = 1280;
    view.image.height = 720;
    for (Forecast& forecast : forecasts) forecast = {1, 0, 1000, true};
    set(fast, 0.04, 2);
    set(middle, 0.02, 8);
    set(fine, 0.004, 30);
    set(finest, 0.0004, 100);
  }

  void set(const Setting& setting, double error, double ms, double spread = 0) {
    forecasts[index_of(setting).value()] = {error, spread, ms, true};
  }

  Setting picked(const Aim& aim) const { return settings[pick(view, forecasts, aim).setting]; }

  const Setting fast{MethodName::kernel, 4, 0};
  const Setting middle{MethodName::kernel, 2, 0};
  const Setting fine{MethodName::kernel, 0, 0};
  const Setting finest{MethodName::slab, 0, 0};
  protocol::View view;
  Forecasts forecasts;
};

TEST_F(Pick, LeastErrorWithinTheBudget) {
  EXPECT_EQ(picked({3, {}}), fast);
  EXPECT_EQ(picked({20, {}}), middle);
  EXPECT_EQ(picked({50, {}}), fine);
  EXPECT_EQ(picked({500, {}}), finest);
  EXPECT_EQ(picked({{}, {}}), finest);
}

TEST_F(Pick, NeverWorseWithALargerBudget) {
  double last = std::numeric_limits<double>::infinity();
  for (double budget = 2.2; budget < 2000; budget *= 1.3) {
    const Choice choice = pick(view, forecasts, {budget, {}});
    EXPECT_TRUE(choice.fits);
    EXPECT_LE(forecasts[choice.setting].ms, budget);
    EXPECT_LE(forecasts[choice.setting].error, last) << budget;
    last = forecasts[choice.setting].error;
  }
}

TEST_F(Pick, FastestWithinTheError) {
  EXPECT_EQ(picked({{}, 0.05}), fast);
  EXPECT_EQ(picked({{}, 0.03}), middle);
  EXPECT_EQ(picked({{}, 0.01}), fine);
  EXPECT_EQ(picked({{}, 0.001}), finest);
}

TEST_F(Pick, LeastErrorWhenNoneMeetsTheLimit) { EXPECT_EQ(picked({{}, 1e-5}), finest); }

TEST_F(Pick, WithBothTheFastestWithinTheErrorElseTheBest) {
  EXPECT_EQ(picked({500, 0.01}), fine);
  EXPECT_EQ(picked({20, 0.01}), middle);
}

TEST_F(Pick, UncertainErrorsMustMeetTheLimitWithTheirSpread) {
  set(middle, 0.02, 8, 0.5);
  EXPECT_EQ(picked({{}, 0.03}), fine);
  EXPECT_EQ(picked({{}, 0.05}), fast);
  // 5 % of a normal distribution are beyond 1.645 standard deviations.
  EXPECT_NEAR(std::log(error_bound({0.02, 0.5, 8, true}) / 0.02) / 0.5, 1.645, 0.01);
}

TEST_F(Pick, FastestWithAFlagWhenNothingFits) {
  const Choice choice = pick(view, forecasts, {1, {}});
  EXPECT_FALSE(choice.fits);
  EXPECT_EQ(settings[choice.setting], fast);
}

TEST_F(Pick, ReducedPicturesWhereALimitIsSet) {
  const auto picked_of = [&](double pixels_most) {
    return settings[pick(view, forecasts, {500, {}}, pixels_most).setting];
  };
  EXPECT_EQ(picked_of(1e9), finest);
  EXPECT_EQ(picked_of(1280 * 720 - 1), middle);
  EXPECT_EQ(picked_of(320 * 180), fast);
  // No setting meets the limit, so it is ignored.
  EXPECT_EQ(picked_of(100), finest);
}

TEST_F(Pick, OnlyAllowedSettings) {
  view.method.name = MethodName::kernel;
  EXPECT_EQ(picked({500, {}}), fine);
  view.quality.max_error = 0.001;
  EXPECT_EQ(picked({500, 0.001}), finest);
}

// The final frame of a view has the view's own setting, and nothing shown before is finer.
TEST_F(Pick, FinerThanTheViewOnlyForAnErrorBound) {
  const Setting thinner{MethodName::slab, 0, 0, 4};
  set(thinner, 1e-5, 120);
  EXPECT_EQ(picked({500, {}}), finest);
  EXPECT_EQ(picked({{}, {}}), finest);
  EXPECT_EQ(picked({{}, 1e-4}), thinner);
  EXPECT_EQ(picked({{}, 1e-4, true}), finest);
  EXPECT_EQ(picked({500, 1e-4, true}), finest);
  view.method.name = MethodName::kernel;
  view.quality.max_error = 1e-4;
  EXPECT_EQ(picked({{}, 1e-4}), thinner);
  EXPECT_EQ(picked({{}, 1e-4, true}), fine);
}

TEST_F(Pick, OneSettingIsFasterThanAllOthers) {
  for (Forecast& forecast : forecasts) forecast.ms = 1000;
  forecasts[index_of(fine).value()].ms = 5;
  EXPECT_EQ(picked({20, {}}), fine);
}

}  // namespace
}  // namespace windsplat::quality
