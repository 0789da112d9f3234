// Round ticks and values as people write them.
#include "server/annotate/labels.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace windsplat::annotate {
namespace {

using testing::ElementsAre;

std::vector<std::string> texts(const std::vector<Tick>& ticks) {
  std::vector<std::string> out;
  for (const Tick& tick : ticks) out.push_back(tick.text);
  return out;
}

TEST(RoundStep, IsTheSmallestOfOneTwoAndFiveThatFits) {
  EXPECT_DOUBLE_EQ(round_step(10, 5), 2);
  EXPECT_DOUBLE_EQ(round_step(10, 4), 5);
  EXPECT_DOUBLE_EQ(round_step(0.003, 3), 0.001);
  EXPECT_DOUBLE_EQ(round_step(101300, 4), 50000);
  EXPECT_EQ(round_step(0, 5), 0);
  EXPECT_EQ(round_step(std::numeric_limits<double>::infinity(), 5), 0);
  EXPECT_DOUBLE_EQ(round_degrees(180, 3), 90);
  EXPECT_DOUBLE_EQ(round_degrees(180, 4), 45);
  EXPECT_DOUBLE_EQ(round_degrees(0.3, 3), 0.1);
}

TEST(NumberText, HasThePrecisionOfTheStep) {
  EXPECT_EQ(number_text(0.5, 0.5), "0.5");
  EXPECT_EQ(number_text(1, 0.25), "1.0");
  EXPECT_EQ(number_text(-20, 10), "\u221220");
  EXPECT_EQ(number_text(101305, 5), "101305") << "four digits would repeat 101300";
  EXPECT_EQ(number_text(3e-8, 1e-8), "3\u00b710\u207b\u2078");
  EXPECT_EQ(number_text(2.5e9, 5e8), "2.5\u00b710\u2079");
  EXPECT_EQ(number_text(-1e-12, 0.1), "0") << "not -0.0";
  EXPECT_EQ(number_text(std::nan(""), 1), "\u2013");
}

TEST(EvenTicks, AreMultiplesOfTheStepInEitherDirection) {
  EXPECT_THAT(texts(even_ticks(-1, 1, 4)),
              ElementsAre("\u22121.0", "\u22120.5", "0", "0.5", "1.0"));
  const auto down = even_ticks(10, 0, 2);
  EXPECT_THAT(texts(down), ElementsAre("0", "5", "10"));
  EXPECT_DOUBLE_EQ(down[0].at, 1) << "descending: 0 is at the end";
  EXPECT_DOUBLE_EQ(down[1].at, 0.5);
  EXPECT_THAT(texts(even_ticks(3, 3, 5)), ElementsAre());
}

// Pressures by their logarithm: the roundest first, none closer than the gap.
TEST(UnevenTicks, PreferRoundValuesAndKeepTheirDistance) {
  const auto place = [](double p) { return std::log(1000 / p) / std::log(1000 / 50.0); };
  const auto ticks = uneven_ticks(1000, 50, 0.15, place);
  EXPECT_THAT(texts(ticks), testing::IsSupersetOf({"1000", "500"}));
  for (std::size_t n = 1; n < ticks.size(); ++n) {
    EXPECT_GE(std::abs(ticks[n].at - ticks[n - 1].at), 0.15);
    EXPECT_NEAR(ticks[n].at, place(ticks[n].value), 1e-12);
    const double digits = ticks[n].value / std::pow(10, std::floor(std::log10(ticks[n].value)));
    EXPECT_DOUBLE_EQ(digits, std::round(digits)) << ticks[n].text << " is not round";
  }
}

TEST(UnitText, RaisesPowersInEveryUsualSpelling) {
  for (const char* units : {"m s-1", "m s**-1", "m s^-1"}) {
    EXPECT_EQ(unit_text(units), "m s\u207b\u00b9") << units;
  }
  EXPECT_EQ(unit_text("kg m-2 s-1"), "kg m\u207b\u00b2 s\u207b\u00b9");
  EXPECT_EQ(unit_text("m2/s2"), "m\u00b2/s\u00b2");
  EXPECT_EQ(unit_text("m s\u207b\u00b9"), "m s\u207b\u00b9");
  EXPECT_EQ(unit_text("1"), "");
  EXPECT_EQ(unit_text("(0 - 1)"), "") << "a fraction, of ECMWF";
  EXPECT_EQ(unit_text("hPa"), "hPa");
  EXPECT_EQ(unit_text("O3x"), "O3x") << "no power";
}

TEST(UnitText, WritesNamesAsSymbols) {
  for (const char* units :
       {"meter second-1", "Metres second^-1", "meters per second", "m per sec"}) {
    EXPECT_EQ(unit_text(units), "m s\u207b\u00b9") << units;
  }
  EXPECT_EQ(unit_text("watts per meter2"), "W m\u207b\u00b2");
  EXPECT_EQ(unit_text("meter/second"), "m/s");
  EXPECT_EQ(unit_text("centimeter/s"), "cm/s");
  EXPECT_EQ(unit_text("Kelvin"), "K");
  EXPECT_EQ(unit_text("degrees_Celsius"), "\u00b0C");
  for (const char* units : {"DEG C", "deg C", "Degrees Celsius", "degree c"}) {
    EXPECT_EQ(unit_text(units), "\u00b0C") << units;
  }
  EXPECT_EQ(unit_text("deg C m-1"), "\u00b0C m\u207b\u00b9");
  EXPECT_EQ(unit_text("deg Cel"), "deg Cel");
  EXPECT_EQ(unit_text("percent"), "%");
  EXPECT_EQ(unit_text("per mille"), "per mille");
  EXPECT_EQ(unit_text("meteors"), "meteors");
}

TEST(CoordinateText, TellsHemispheres) {
  data::Axis axis;
  axis.kind = data::AxisKind::longitude;
  EXPECT_EQ(coordinate_text(axis, 10, 10), "10\u00b0E");
  EXPECT_EQ(coordinate_text(axis, 190, 10), "170\u00b0W");
  EXPECT_EQ(coordinate_text(axis, 360, 10), "0\u00b0");
  EXPECT_EQ(coordinate_text(axis, -180, 10), "180\u00b0");
  axis.kind = data::AxisKind::latitude;
  EXPECT_EQ(coordinate_text(axis, -22.5, 0.5), "22.5\u00b0S");
  EXPECT_EQ(coordinate_text(axis, 0, 10), "0\u00b0");
}

TEST(TimeText, DropsWhatTellsNothing) {
  EXPECT_EQ(time_text("2001-01-01T03:00:00Z"), "2001-01-01 03:00Z");
  EXPECT_EQ(time_text("2001-01-01T03:00:30Z"), "2001-01-01 03:00:30Z");
  EXPECT_EQ(time_text("12.5 s"), "12.5 s");
}

}  // namespace
}  // namespace windsplat::annotate
