// Levels of GRIB messages: their values in the units of the axis, and which end is up.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace windsplat::data::test

#endif
