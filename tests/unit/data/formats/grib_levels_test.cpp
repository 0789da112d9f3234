// Levels of GRIB messages: their values in the units of the axis, and which end is up.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"

#ifdef WINDSPLAT_GRIB
#include "tests/unit/data/formats/grib_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::DoubleEq;
using testing::ElementsAre;

// A temperature of `value` everywhere.
std::string constant(Maker& maker, double value) {
  maker.set("shortName", std::string("t"));
  maker.fill(value);
  return maker.bytes();
}

std::string at_level(int edition, const std::string& type, long level, double value) {
  Maker maker(edition == 1 ? "GRIB1" : "GRIB2");
  maker.set("typeOfLevel", type);
  maker.set("level", level);
  return constant(maker, value);
}

std::string layer(int edition, const std::string& type, long top, long bottom, double value) {
  Maker maker(edition == 1 ? "GRIB1" : "GRIB2");
  maker.set("typeOfLevel", type);
  maker.set("topLevel", top);
  maker.set("bottomLevel", bottom);
  return constant(maker, value);
}

// Surfaces of edition 2 with a common scale factor; no second one if it is negative.
std::string surfaces(long type, long factor, long first, long second, double value) {
  Maker maker("GRIB2");
  maker.set("typeOfFirstFixedSurface", type);
  if (second >= 0) {
    maker.set("typeOfSecondFixedSurface", type);
    maker.set("scaleFactorOfSecondFixedSurface", factor);
    maker.set("scaledValueOfSecondFixedSurface", second);
  }
  maker.set("scaleFactorOfFirstFixedSurface", factor);
  maker.set("scaledValueOfFirstFixedSurface", first);
  return constant(maker, value);
}

class GribLevels : public GribFiles {
 protected:
  struct Column {
    Axis axis;
    std::vector<float> values;  // from the lowest level up
  };
  Column column(const std::string& bytes) {
    const auto source = open(bytes);
    if (!source) return {};
    const Axis axis = source->info().grid.axes[2];
    const auto volume = source->read(0, 0);
    EXPECT_TRUE(volume) << volume.error().message;
    Column out{axis, {}};
    if (!volume) return out;
    const auto& dims = source->info().grid.dims();
    const auto plane = static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]);
    for (int level = 0; level < dims[2]; ++level) {
      out.values.push_back(volume->values[plane * static_cast<std::size_t>(level)]);
    }
    return out;
  }
};

TEST_F(GribLevels, DepthsAndHeightsOfEdition1AreInMetres) {
  const Column land =
      column(at_level(1, "depthBelowLand", 7, 7) + at_level(1, "depthBelowLand", 28, 28) +
             at_level(1, "depthBelowLand", 100, 100));
  EXPECT_EQ(land.axis.kind, AxisKind::depth);
  EXPECT_EQ(land.axis.units, "m");
  EXPECT_THAT(land.axis.coordinates, ElementsAre(1, 0.28, 0.07));
  EXPECT_THAT(land.values, ElementsAre(100, 28, 7));

  const Column soil =
      column(layer(1, "depthBelowLandLayer", 0, 7, 1) + layer(1, "depthBelowLandLayer", 7, 28, 2));
  EXPECT_THAT(soil.axis.coordinates, ElementsAre(0.175, 0.035));
  EXPECT_THAT(soil.values, ElementsAre(2, 1));

  const Column ground = column(layer(1, "heightAboveGroundLayer", 20, 10, 1) +
                               layer(1, "heightAboveGroundLayer", 40, 20, 2));
  EXPECT_EQ(ground.axis.kind, AxisKind::height);
  EXPECT_THAT(ground.axis.coordinates, ElementsAre(1500, 3000));
  const Column sea =
      column(layer(1, "heightAboveSeaLayer", 2, 0, 1) + layer(1, "heightAboveSeaLayer", 4, 2, 2));
  EXPECT_EQ(sea.axis.kind, AxisKind::height);
  EXPECT_THAT(sea.axis.coordinates, ElementsAre(100, 300));
}

TEST_F(GribLevels, SurfacesOfEdition2KeepTheirFractions) {
  const Column soil =
      column(surfaces(106, 2, 0, 10, 1) + surfaces(106, 2, 10, 40, 2) + surfaces(106, 1, 4, 10, 3));
  EXPECT_EQ(soil.axis.kind, AxisKind::depth);
  EXPECT_THAT(soil.axis.coordinates, ElementsAre(0.7, 0.25, 0.05));
  EXPECT_THAT(soil.values, ElementsAre(3, 2, 1));

  const Column air = column(surfaces(100, 0, 15050, -1, 1) + surfaces(100, 0, 15000, -1, 2));
  EXPECT_EQ(air.axis.units, "hPa");
  EXPECT_THAT(air.axis.coordinates, ElementsAre(150.5, 150));
  EXPECT_THAT(air.values, ElementsAre(1, 2));

  const Column layers = column(surfaces(100, -2, 1000, 850, 1) + surfaces(100, -2, 850, 700, 2));
  EXPECT_EQ(layers.axis.kind, AxisKind::pressure);
  EXPECT_THAT(layers.axis.coordinates, ElementsAre(925, 775));
}

TEST_F(GribLevels, PressuresBelowAndAbove1HPaAreOneAxis) {
  const Column air = column(surfaces(100, 0, 100000, -1, 1) + surfaces(100, 0, 100, -1, 2) +
                            surfaces(100, 0, 50, -1, 3) + surfaces(100, 1, 125, -1, 4));
  EXPECT_EQ(air.axis.units, "hPa");
  EXPECT_THAT(air.axis.coordinates, ElementsAre(1000, 1, 0.5, DoubleEq(0.125)));
  EXPECT_THAT(air.values, ElementsAre(1, 2, 3, 4));
}

// Level 1, 2, 3 with their number as value; the lowest first.
TEST_F(GribLevels, NumberedLevelsRunAsTheirKindIsNumbered) {
  const std::vector<std::pair<std::string, bool>> falls{
      {"hybrid", true},    {"hybridHeight", false},   {"sigma", true},      {"eta", true},
      {"soilLayer", true}, {"snowLayer", true},       {"soil", true},       {"oceanModel", true},
      {"theta", false},    {"oceanModelLayer", true}, {"hybridLayer", true}};
  for (const auto& [type, down] : falls) {
    SCOPED_TRACE(type);
    std::string bytes;
    for (const long level : {1, 2, 3}) {
      bytes += at_level(2, type, level, static_cast<double>(level));
    }
    const Column found = column(bytes);
    EXPECT_EQ(found.axis.kind, AxisKind::level);
    EXPECT_THAT(found.values, down ? ElementsAre(3, 2, 1) : ElementsAre(1, 2, 3));
  }
}

TEST_F(GribLevels, SigmaOfEdition1IsAFraction) {
  const Column air = column(at_level(1, "sigma", 9950, 1) + at_level(1, "sigma", 5000, 2));
  EXPECT_THAT(air.axis.coordinates, ElementsAre(0.995, 0.5));
  const Column layers =
      column(layer(1, "sigmaLayer", 44, 100, 1) + layer(1, "sigmaLayer", 33, 44, 2));
  EXPECT_THAT(layers.axis.coordinates, ElementsAre(0.72, DoubleEq(0.385)));
  EXPECT_THAT(layers.values, ElementsAre(1, 2));
}

// A message of a hybrid level with coefficients, a and b of half levels.
std::string at_hybrid(const char* name, long level, double value, const std::vector<double>& pv) {
  Maker maker("GRIB2");
  maker.set("typeOfLevel", std::string("hybrid"));
  maker.set("level", level);
  maker.set("shortName", std::string(name));
  maker.set("PVPresent", 1L);
  EXPECT_EQ(codes_set_double_array(maker.handle(), "pv", pv.data(), pv.size()), CODES_SUCCESS);
  maker.fill(value);
  return maker.bytes();
}

// Full levels lie at the means of their half levels: p = a + b ps.
TEST_F(GribLevels, HybridLevelsHavePressuresByTheirCoefficients) {
  const std::vector<double> pv{0, 2000, 8000, 0, 0, 0, 0.25, 1};
  for (const bool by_logarithm : {true, false}) {
    const double surface = 96000;
    std::string bytes;
    for (const long level : {1L, 2L, 3L}) {
      bytes += at_hybrid("t", level, 200 + 10.0 * static_cast<double>(level), pv);
    }
    if (by_logarithm) {
      bytes += at_hybrid("lnsp", 1, std::log(surface), pv);
    } else {
      Maker maker("GRIB2");
      maker.set("typeOfLevel", std::string("surface"));
      maker.set("shortName", std::string("sp"));
      maker.fill(surface);
      bytes += maker.bytes();
    }
    const auto source = open(bytes);
    ASSERT_TRUE(source);
    const DatasetInfo& info = source->info();
    const Axis& z = info.grid.axes[2];
    EXPECT_EQ(z.kind, AxisKind::pressure);
    ASSERT_EQ(z.coordinates.size(), 3U);
    const std::vector<double> expected{4000 + 0.625 * surface, 5000 + 0.125 * surface, 1000};
    const FieldInfo* pressure = info.find("pressure");
    ASSERT_NE(pressure, nullptr);
    const auto volume = source->read(static_cast<std::size_t>(pressure - info.fields.data()), 0);
    ASSERT_TRUE(volume) << volume.error().message;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(z.coordinates[k], expected[k], 1);
      EXPECT_NEAR(volume->values[12 * k + 5], expected[k], 1);
    }
    const FieldInfo* t = info.find("t");
    ASSERT_NE(t, nullptr);
    const auto warmth = source->read(static_cast<std::size_t>(t - info.fields.data()), 0);
    ASSERT_TRUE(warmth);
    EXPECT_NEAR(warmth->values[0], 230, 0.1) << "the third level is the lowest";
  }
}

// Two grids share the levels; the surface pressure of the shown one counts, wherever it is.
TEST_F(GribLevels, HybridLevelsOfTwoGridsHavePressuresWhereTheSurfaceIsKnown) {
  const std::vector<double> pv{0, 2000, 8000, 0, 0, 0, 0.25, 1};
  const auto coarse = [&](const char* name, long level, double value) {
    Maker maker("GRIB2");
    maker.set("typeOfLevel", std::string("hybrid"));
    maker.set("level", level);
    maker.set("shortName", std::string(name));
    maker.set("PVPresent", 1L);
    EXPECT_EQ(codes_set_double_array(maker.handle(), "pv", pv.data(), pv.size()), CODES_SUCCESS);
    maker.fill(value);
    maker.set("Ni", 2L);
    maker.set("longitudeOfLastGridPointInDegrees", 20.0);
    maker.values(std::vector<double>(6, value));
    return maker.bytes();
  };
  for (const bool has_both : {false, true}) {
    std::string bytes;
    for (const long level : {1L, 2L, 3L}) bytes += coarse("t", level, 250);
    if (has_both) bytes += coarse("lnsp", 1, std::log(50000.0));
    for (const long level : {1L, 2L, 3L}) bytes += at_hybrid("t", level, 200, pv);
    bytes += at_hybrid("lnsp", 1, std::log(96000.0), pv);
    const auto source = open(bytes);
    ASSERT_TRUE(source);
    const Axis& z = source->info().grid.axes[2];
    ASSERT_EQ(z.kind, AxisKind::pressure) << has_both;
    EXPECT_NEAR(z.coordinates[0], 4000 + 0.625 * 96000, 1);
    const auto& notes = source->info().notes;
    EXPECT_EQ(std::any_of(notes.begin(), notes.end(),
                          [](const std::string& note) {
                            return note.find("unknown on grids where the file has neither") !=
                                   std::string::npos;
                          }),
              !has_both);
  }
}

// Other coefficients, and levels without a surface pressure, stay numbers.
TEST_F(GribLevels, HybridLevelsOfOtherKindsStayNumbers) {
  const std::vector<double> pressures{0, 2000, 8000, 0, 0, 0, 0.25, 1};
  const std::vector<double> heights{2, 3, 1e5, 288, 42, 0.1, 0.5, 1};
  for (const bool of_pressure : {true, false}) {
    const auto& pv = of_pressure ? pressures : heights;
    std::string bytes = at_hybrid("t", 1, 200, pv) + at_hybrid("t", 2, 210, pv);
    if (!of_pressure) bytes += at_hybrid("lnsp", 1, 11.5, pv);
    const auto source = open(bytes);
    ASSERT_TRUE(source);
    EXPECT_EQ(source->info().grid.axes[2].kind, AxisKind::level);
    const auto& notes = source->info().notes;
    EXPECT_EQ(std::any_of(notes.begin(), notes.end(),
                          [](const std::string& note) {
                            return note.find("neither 'sp' nor 'lnsp'") != std::string::npos;
                          }),
              of_pressure);
  }
}

}  // namespace
}  // namespace windsplat::data::test

#endif
