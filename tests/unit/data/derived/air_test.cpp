// Temperature and humidity derived from what a file has, against tables.
#include <gtest/gtest.h>

#include <cmath>

#include "server/data/derived/moist_air.hpp"
#include "tests/unit/data/derived/formula_source.hpp"

namespace windsplat::data::derived_test {
namespace {

TEST(MoistAir, SaturationPressureIsThatOfTheTables) {
  // Over water (WMO, Technical Regulations, appendix A): Pa.
  struct Row {
    double celsius, pascals;
  };
  for (const Row& row : {Row{-30, 50.9}, Row{-10, 286.5}, Row{0, 611.2}, Row{10, 1227.9},
                         Row{20, 2338.8}, Row{30, 4245.5}}) {
    EXPECT_NEAR(derived::saturation_pressure(273.15 + row.celsius) / row.pascals, 1, 0.004)
        << row.celsius;
  }
}

TEST(MoistAir, PotentialTemperatureIsTheTemperatureAtThousandHectopascals) {
  EXPECT_DOUBLE_EQ(derived::temperature_of(287.5, 100000), 287.5);
  // 0.5^0.2854 = exp(-0.2854 ln 2).
  EXPECT_NEAR(derived::temperature_of(300, 50000), 300 * std::exp(-0.2854 * 0.69314718056), 1e-9);
}

Grid on_pressures() {
  Grid grid;
  grid.axes = {axis_of(AxisKind::longitude, "degrees_east", evenly(0, 1, 3)),
               axis_of(AxisKind::latitude, "degrees_north", evenly(0, 1, 3)),
               axis_of(AxisKind::pressure, "hPa", {1000, 500})};
  return grid;
}

Formula always(double value) {
  return [value](std::size_t, std::size_t, std::size_t) { return Vec{value, 0, 0}; };
}

TEST(DerivedAir, TemperatureFollowsFromPotentialTemperatureAndTheLevels) {
  auto source = std::make_unique<FormulaSource>(on_pressures());
  source->add("pt", {"K"}, always(300), "air_potential_temperature");
  const auto derived = derive(std::move(source));
  EXPECT_EQ(derived->info().find("temperature")->units, "K");
  const Volume t = volume_of(*derived, "temperature");
  EXPECT_NEAR(static_cast<double>(t.values.data()[0]), 300, 1e-4);
  EXPECT_NEAR(static_cast<double>(t.values.data()[9]), 300 * std::pow(0.5, 0.2854), 1e-4);
}

TEST(DerivedAir, SaturatedAirHasARelativeHumidityOfAHundredPercent) {
  // At 20 degrees and 1000 hPa: r = 0.622 e / (p - e), q = r / (1 + r), e = 23.37 hPa by Bolton.
  const double e = derived::saturation_pressure(293.15);
  const double ratio = 0.622 * e / (100000 - e);
  struct Case {
    const char* name;
    const char* units;
    double value;
  };
  for (const Case& one : {Case{"q", "kg kg-1", ratio / (1 + ratio)},
                          Case{"q", "g/kg", 1000 * ratio / (1 + ratio)}, Case{"qv", "1", ratio}}) {
    auto source = std::make_unique<FormulaSource>(on_pressures());
    source->add("t", {"degC"}, always(20));
    source->add(one.name, {one.units}, always(one.value));
    const Volume humidity = volume_of(*derive(std::move(source)), "relative_humidity");
    EXPECT_NEAR(static_cast<double>(humidity.values.data()[0]), 100, 1e-3) << one.name;
    EXPECT_LT(humidity.values.data()[9], 51.0F);  // the same mixing ratio at half the pressure
    EXPECT_GT(humidity.values.data()[9], 49.0F);
  }
}

TEST(DerivedAir, PressureOfSamplesIsPreferredToThatOfTheLevels) {
  auto source = std::make_unique<FormulaSource>(on_pressures());
  source->add("theta", {"K"}, always(300));
  source->add("p", {"hPa"}, always(250), "air_pressure");
  const Volume t = volume_of(*derive(std::move(source)), "temperature");
  EXPECT_NEAR(static_cast<double>(t.values.data()[9]), 300 * std::pow(0.25, 0.2854), 1e-4);
}

TEST(DerivedAir, WhatTheFileHasIsNotDerived) {
  auto source = std::make_unique<FormulaSource>(on_pressures());
  source->add("theta", {"K"}, always(300));
  source->add("ta", {"K"}, always(280), "air_temperature");
  source->add("q", {"kg kg-1"}, always(0.01));
  source->add("rh", {"%"}, always(50));
  EXPECT_EQ(derive(std::move(source))->info().fields.size(), 4U);
}

TEST(DerivedAir, WithoutPressureNothingIsDerived) {
  Grid grid = on_pressures();
  grid.axes[2] = axis_of(AxisKind::height, "m", {0, 1000});
  auto source = std::make_unique<FormulaSource>(grid);
  source->add("theta", {"K"}, always(300));
  source->add("q", {"kg kg-1"}, always(0.01));
  EXPECT_EQ(derive(std::move(source))->info().fields.size(), 2U);
}

}  // namespace
}  // namespace windsplat::data::derived_test
