// Fronts, orders and medians of synthetic curves.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/study/types.hpp"

namespace windsplat::study {
namespace {

Point point(double ms, double rmse, bool stable = true) {
  Point p;
  p.measured.ms = ms;
  p.measured.rmse = rmse;
  p.measured.stable = stable;
  return p;
}

std::vector<bool> front(std::vector<Point> points) {
  mark_pareto(points);
  std::vector<bool> marks;
  for (const Point& p : points) marks.push_back(p.pareto);
  return marks;
}

TEST(Pareto, ContainsTheUndominatedPoints) {
  const std::vector<bool> expected{true, false, true, true, false};
  EXPECT_EQ(front({point(1, 0.1), point(2, 0.2), point(2, 0.05), point(9, 0.01), point(9, 0.02)}),
            expected);
}

TEST(Pareto, KeepsEqualPointsAndOmitsUnstableAndUnknownOnes) {
  EXPECT_EQ(front({point(1, 0.1), point(1, 0.1)}), (std::vector<bool>{true, true}));
  EXPECT_EQ(front({point(1, 0.1), point(0.5, 0.01, false)}), (std::vector<bool>{true, false}));
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(front({point(1, 0.1), point(0.5, unknown)}), (std::vector<bool>{true, false}));
  EXPECT_EQ(front({point(1, unknown), point(2, unknown)}), (std::vector<bool>{false, false}));
}

TEST(Slope, IsTheExponentOfAPowerLaw) {
  const std::vector<double> x{2, 1, 0.5, 0.25};
  for (const double order : {-0.5, 1.0, 2.0, 3.5}) {
    std::vector<double> y;
    for (const double v : x) y.push_back(0.3 * std::pow(v, order));
    EXPECT_NEAR(log_slope(x, y), order, 1e-12);
  }
}

TEST(Slope, SkipsNonPositiveValuesAndNeedsThreePoints) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(log_slope({4, 2, 1, 0, 8}, {16, 4, 1, 1, inf}), 2, 1e-12);
  EXPECT_TRUE(std::isnan(log_slope({4, 2, 0}, {16, 4, 1})));
  EXPECT_TRUE(std::isnan(log_slope({2, 2, 2}, {16, 4, 1})));
}

TEST(Order, IsFittedOverTheParameterOfTheCurveAndStablePoints) {
  std::vector<Point> points;
  for (const double thickness : {2.0, 1.0, 0.5, 0.25}) {
    points.push_back(point(1 / thickness, 0.01 * thickness * thickness));
    points.back().setting.knobs.slab_thickness = thickness;
  }
  points.push_back(point(1, 1e9, false));
  points.back().setting.knobs.slab_thickness = 4;
  Curve curve;
  curve.knob = Knob::slab_thickness;
  curve.points = {4, 0, 1, 2, 3};
  find_order(points, curve);
  EXPECT_NEAR(curve.order, 2, 1e-12);
}

TEST(Median, IsTheMiddleValueOrTheMeanOfTheMiddleTwo) {
  EXPECT_EQ(median({9, 1, 5}), 5);
  EXPECT_EQ(median({9, 1, 5, 7}), 6);
}

}  // namespace
}  // namespace windsplat::study
