// Forecasts of sizes between the settings of the list, and where such sizes are used.
#include "server/quality/sizes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace windsplat::quality {
namespace {

using protocol::MethodName;

// A picture of kernels that is enlarged has 0.02 times the power of its scale as error, the full
// one 0.005; times are proportional to pixels.
Forecasts known(double power) {
  Forecasts out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double halvings = 0.5 * settings[i].half_level;
    out[i].error = halvings > 0 ? 0.02 * std::exp2(power * halvings) : 0.005;
    out[i].ms = 100 * std::exp2(-2 * halvings);
    out[i].spread = 0.1 + 0.01 * settings[i].half_level;
    out[i].timed = true;
  }
  return out;
}

Setting of_size(int sixteenths, int coarser = 0) {
  return {MethodName::kernel, sixteenths / 8, coarser, 1, sixteenths % 8};
}

TEST(ForecastBetween, FollowsPowersOfTheSize) {
  for (const double power : {0.5, 1.0, 2.0}) {
    const Forecasts forecasts = known(power);
    for (const int sixteenths : {1, 4, 8, 11, 23, 40, 45, 55}) {
      const Forecast at = forecast_between(of_size(sixteenths), forecasts);
      const double halvings = sixteenths / 16.0;
      EXPECT_NEAR(at.ms, 100 * std::exp2(-2 * halvings), 1e-9 * at.ms) << sixteenths;
      EXPECT_NEAR(at.error, 0.02 * std::exp2(power * halvings), 1e-9) << sixteenths;
      EXPECT_TRUE(at.timed);
    }
    for (std::size_t i = 0; i < settings_count; ++i) {
      EXPECT_EQ(forecast_between(settings[i], forecasts).error, forecasts[i].error);
    }
  }
}

// Where merging causes the error a smaller picture may have less of it.
TEST(ForecastBetween, HasNoLessErrorThanItsNeighbours) {
  Forecasts forecasts = known(1);
  forecasts[index_of(of_size(0, 1)).value()].error = 0.06;
  forecasts[index_of(of_size(8, 1)).value()].error = 0.055;
  forecasts[index_of(of_size(16, 1)).value()].error = 0.0616;
  const double error = forecast_between(of_size(4, 1), forecasts).error;
  EXPECT_NEAR(error, std::sqrt(0.06 * 0.055), 1e-9);
}

TEST(Options, AreBetweenKnownTimesOfOneLevelOfTheData) {
  protocol::View view;
  view.image = {1280, 720};
  Forecasts forecasts = known(1);
  Halvings halvings{0, 0, 0, 0, 1, 1, 1, 2, 2};
  Sizes sizes;
  const auto has = [&](const Setting& setting) {
    const auto options = options_of(view, forecasts, halvings, sizes);
    return std::any_of(options.begin(), options.end(),
                       [&](const Option& option) { return option.setting == setting; });
  };
  for (int sixteenths = 0; sixteenths < 24; ++sixteenths) EXPECT_TRUE(has(of_size(sixteenths)));
  for (int sixteenths = 25; sixteenths < 32; ++sixteenths) EXPECT_FALSE(has(of_size(sixteenths)));
  EXPECT_TRUE(has(of_size(41))) << "of the same level at both ends";
  EXPECT_FALSE(has(of_size(55))) << "below 64 pixels";
  EXPECT_TRUE(has(of_size(12, 1)));
  forecasts[index_of(of_size(8)).value()].timed = false;
  EXPECT_FALSE(has(of_size(4)));
  EXPECT_FALSE(has(of_size(12)));
  EXPECT_TRUE(has(of_size(20)));
  EXPECT_EQ(options_of(view, forecasts, std::nullopt, sizes, of_size(4)).back().setting,
            of_size(4));
}

}  // namespace
}  // namespace windsplat::quality
