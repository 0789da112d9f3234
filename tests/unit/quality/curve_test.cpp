// Synthetic forecasts -> the reported curve.
#include "server/quality/curve.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "server/quality/pick.hpp"

namespace windsplat::quality {
namespace {

using protocol::ForecastDescription;
using protocol::ForecastPoint;
using protocol::MethodName;

class Curve : public testing::Test {
 protected:
  void SetUp() override {
    view.image.width = 1920;  // so that no setting is too small
    view.image.height = 1080;
    view.quality.max_error = 0.5;  // so that slabs are allowed
    for (std::size_t i = 0; i < forecasts.size(); ++i) {
      // Unsorted and all different.
      forecasts[i].ms = 1 + std::fmod(20 + 37.0 * static_cast<double>(i), 53.0);
      forecasts[i].error = 1e-3 * (1 + std::fmod(29.0 * static_cast<double>(i), 61.0));
      forecasts[i].spread = 0.1 + 0.01 * static_cast<double>(i);
    }
  }

  protocol::View view;
  Forecasts forecasts;
};

TEST_F(Curve, IsSortedByTimeAndContainsEveryAllowedSetting) {
  const ForecastDescription out = curve(view, forecasts);
  EXPECT_EQ(out.width, 1920);
  EXPECT_EQ(out.height, 1080);
  ASSERT_EQ(out.points.size(), settings_count);
  std::multiset<double> told;
  std::multiset<double> forecast;
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    told.insert(out.points[i].ms);
    forecast.insert(forecasts[i].ms);
    EXPECT_LE(out.points[i > 0 ? i - 1 : 0].ms, out.points[i].ms);
  }
  EXPECT_EQ(told, forecast);
  view.quality.max_error.reset();
  view.method.name = MethodName::kernel;
  for (const ForecastPoint& point : curve(view, forecasts).points) {
    EXPECT_EQ(point.method, "kernel");
    EXPECT_FALSE(point.slab_thickness);
  }
  EXPECT_LT(curve(view, forecasts).points.size(), settings_count);
}

// The definition, applied to every pair of points.
TEST_F(Curve, FrontContainsTheUndominatedPoints) {
  forecasts[3] = forecasts[7] = {0.05, 0.1, 0.5, true};  // of two equal points one suffices
  const ForecastDescription out = curve(view, forecasts);
  int on_front = 0;
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    const ForecastPoint& point = out.points[i];
    bool beaten = false;
    for (std::size_t j = 0; j < out.points.size(); ++j) {
      const ForecastPoint& other = out.points[j];
      const bool no_worse = other.ms <= point.ms && other.error <= point.error;
      const bool better = other.ms < point.ms || other.error < point.error || j < i;
      beaten = beaten || (j != i && no_worse && better);
    }
    EXPECT_EQ(point.pareto, !beaten) << i;
    on_front += point.pareto ? 1 : 0;
  }
  EXPECT_GT(on_front, 1);
  EXPECT_LT(on_front, static_cast<int>(settings_count) - 1);
}

TEST_F(Curve, PointContainsItsSetting) {
  view.method.slab_thickness = 3;
  const Setting setting{MethodName::slab, 2, 1};
  const Setting thin{MethodName::slab, 0, 0, 4};
  forecasts[*index_of(setting)].ms = 0.5;
  forecasts[*index_of(thin)].ms = 0.25;
  forecasts[*index_of(thin)].measured = true;
  forecasts[*index_of(setting)].timed = true;
  const auto points = curve(view, forecasts).points;
  EXPECT_EQ(points[0].slab_thickness, 0.75);
  EXPECT_EQ(points[0].width, 1920);
  EXPECT_TRUE(points[0].measured);
  EXPECT_FALSE(points[0].timed);
  EXPECT_EQ(points[1].method, "slab");
  EXPECT_EQ(points[1].slab_thickness, 3);
  EXPECT_EQ(points[1].width, 960);
  EXPECT_EQ(points[1].height, 540);
  EXPECT_EQ(points[1].coarser, 1);
  EXPECT_FALSE(points[1].measured);
  EXPECT_TRUE(points[1].timed);
}

// ln(error) is normally distributed: 5 % are beyond 1.645 standard deviations on either side.
TEST_F(Curve, BoundsAreThoseOfALogNormalErrorWithinPossibleErrors) {
  for (Forecast& forecast : forecasts) forecast = {0.01, 0.4, 1, true};
  for (const ForecastPoint& point : curve(view, forecasts).points) {
    EXPECT_NEAR(std::log(point.error_high / point.error), 1.645 * 0.4, 0.01);
    EXPECT_NEAR(std::log(point.error / point.error_low), 1.645 * 0.4, 0.01);
  }
  for (Forecast& forecast : forecasts) forecast = {0.9, 20, 1, true};
  for (const ForecastPoint& point : curve(view, forecasts).points) {
    EXPECT_EQ(point.error_high, 1);
    EXPECT_GT(point.error_low, 0);
    EXPECT_LT(point.error_low, 1e-4);
  }
}

TEST_F(Curve, ChosenPointIsThePickedSetting) {
  view.quality = {};
  EXPECT_FALSE(curve(view, forecasts).chosen);
  for (const double budget : {3.0, 9.0, 20.0, 60.0}) {
    for (const double error : {0.004, 0.02, 0.5}) {
      view.quality.budget_ms = budget;
      view.quality.max_error = error;
      const ForecastDescription out = curve(view, forecasts);
      const Choice choice = pick(view, forecasts, {budget, error});
      ASSERT_TRUE(out.chosen);
      EXPECT_EQ(out.points[*out.chosen].ms, forecasts[choice.setting].ms);
      EXPECT_EQ(out.points[*out.chosen].error, forecasts[choice.setting].error);
    }
  }
}

// A picture is encoded within its budget too, which the points do not include.
TEST_F(Curve, ChosenPointLeavesTimeForEncoding) {
  view.quality.budget_ms = 20;
  const double slow = 1e-4;  // ms for each pixel
  const ForecastDescription out = curve(view, forecasts, slow);
  const Choice choice = pick(view, with_encoding(view, forecasts, slow), {20.0, 0.5});
  ASSERT_TRUE(out.chosen);
  const ForecastPoint& point = out.points[*out.chosen];
  EXPECT_EQ(point.ms, forecasts[choice.setting].ms);
  EXPECT_NE(out.chosen, curve(view, forecasts).chosen) << "otherwise this test proves nothing";
  EXPECT_TRUE(choice.fits);
  EXPECT_LE(point.ms + slow * point.width * point.height, 20);
}

// One scene: near the measured viewpoint and as far from it as possible.
TEST(Measured, IsReportedForErrorsOfNearbyViewpointsOnly) {
  Table table{Kind{}};
  const Viewpoint viewpoint{1, {0, 1, 0}, 640, 480};
  Viewpoint beside = viewpoint;
  beside.direction = {std::sin(0.02), std::cos(0.02), 0};
  Viewpoint behind = viewpoint;
  behind.direction = {0, -1, 0};
  EXPECT_FALSE(table.forecast(0, viewpoint).measured);
  table.add(0, viewpoint, {{}, 3.0});
  EXPECT_FALSE(table.forecast(0, viewpoint).measured) << "only its time was measured";
  table.add(0, viewpoint, {0.01, {}});
  EXPECT_TRUE(table.forecast(0, viewpoint).measured);
  EXPECT_TRUE(table.forecast(0, beside).measured);
  EXPECT_FALSE(table.forecast(0, behind).measured);
  EXPECT_FALSE(table.forecast(1, viewpoint).measured) << "another setting";
}

}  // namespace
}  // namespace windsplat::quality
