// Levels whose coordinate only numbers them, placed by an auxiliary coordinate, as in files of the
// Unified Model written by iris.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::ElementsAre;

struct Levels {
  std::vector<double> numbers{1, 2, 3, 4};
  std::vector<double> heights{20, 80, 200, 900};
  std::string units = "m";
  std::string positive = "up";
  bool is_formula = false;  // with sigma and the altitude of the ground
};

constexpr std::size_t columns = 6;

void write_levels(const std::string& path, const Levels& levels) {
  NetcdfMaker file(path);
  const int z = file.axis("model_level_number", levels.numbers, "1", "model_level_number");
  const int height = file.variable("level_height", NC_DOUBLE, {z}, levels.heights);
  file.text(height, "units", levels.units);
  file.text(height, "positive", levels.positive);
  file.text(height, "long_name", "level_height");
  const int y = file.axis("latitude", {50, 51}, "degrees_north");
  const int x = file.axis("longitude", {0, 1, 2}, "degrees_east");
  const int t =
      file.variable("t", NC_FLOAT, {z, y, x}, counting(columns * levels.heights.size(), 250));
  file.text(t, "units", "K");
  file.text(t, "coordinates", "level_height sigma surface_altitude");
  if (!levels.is_formula) return;
  file.text(height, "standard_name", "atmosphere_hybrid_height_coordinate");
  file.text(height, "formula_terms", "a: level_height b: sigma orog: surface_altitude");
  file.variable("sigma", NC_DOUBLE, {z}, {1, 0.9, 0.5, 0});
  const int ground =
      file.variable("surface_altitude", NC_DOUBLE, {y, x}, {0, 100, 200, 300, 400, 500});
  file.text(ground, "units", "m");
}

TEST(AuxiliaryLevels, NumberedLevelsLieAtTheHeightsOfTheFile) {
  const Folder folder;
  write_levels(folder / "um.nc", {});
  const auto source = opened(folder / "um.nc");
  const Axis& axis = source->info().grid.axes[2];
  EXPECT_EQ(axis.kind, AxisKind::height);
  EXPECT_EQ(axis.units, "m");
  EXPECT_THAT(axis.coordinates, ElementsAre(20, 80, 200, 900));
  EXPECT_TRUE(has_note(source->info(), "levels are placed by 'level_height'"));
  EXPECT_EQ(reason_of(source->info(), "level_height"), "");
  EXPECT_EQ(volume_of(*source, "t").values[0], 250);
}

TEST(AuxiliaryLevels, LevelsNumberedFromTheTopAreTurned) {
  const Folder folder;
  write_levels(folder / "down.nc", {{1, 2, 3, 4}, {900, 200, 80, 20}});
  const auto source = opened(folder / "down.nc");
  EXPECT_THAT(source->info().grid.axes[2].coordinates, ElementsAre(20, 80, 200, 900));
  EXPECT_EQ(volume_of(*source, "t").values[0], 250 + 3 * columns);
}

TEST(AuxiliaryLevels, DepthsRunDown) {
  const Folder folder;
  write_levels(folder / "sea.nc", {{1, 2, 3}, {5, 50, 500}, "m", "down"});
  const auto source = opened(folder / "sea.nc");
  EXPECT_EQ(source->info().grid.axes[2].kind, AxisKind::depth);
  EXPECT_THAT(source->info().grid.axes[2].coordinates, ElementsAre(500, 50, 5));
  EXPECT_EQ(volume_of(*source, "t").values[0], 250 + 2 * columns);
}

struct Auxiliary {
  std::string name;
  std::string long_name;
  std::string standard_name;
  std::vector<double> values{5, 50, 500, 5000};
};

// Levels numbered from the surface of the sea, and a coordinate of theirs in metres.
void write_auxiliary(const std::string& path, const Auxiliary& one) {
  NetcdfMaker file(path);
  const int z = file.axis("lev", {1, 2, 3, 4}, "");
  file.text(file.variable_id("lev"), "axis", "Z");
  const int v = file.variable(one.name, NC_DOUBLE, {z}, one.values);
  file.text(v, "units", "m");
  if (!one.long_name.empty()) file.text(v, "long_name", one.long_name);
  if (!one.standard_name.empty()) file.text(v, "standard_name", one.standard_name);
  const int y = file.axis("latitude", {50, 51}, "degrees_north");
  const int x = file.axis("longitude", {0, 1, 2}, "degrees_east");
  const int t = file.variable("t", NC_FLOAT, {z, y, x}, counting(columns * 4, 250));
  file.text(t, "units", "K");
  file.text(t, "coordinates", one.name);
}

TEST(AuxiliaryLevels, DepthsByNameOrDescriptionAreNoHeights) {
  const Folder folder;
  for (const Auxiliary& one :
       {Auxiliary{"depth", "", ""}, Auxiliary{"z_t", "depth from surface to midpoint of layer", ""},
        Auxiliary{"soil_depth", "", ""}, Auxiliary{"zt", "", "depth"}}) {
    write_auxiliary(folder / "d.nc", one);
    const auto source = opened(folder / "d.nc");
    EXPECT_EQ(source->info().grid.axes[2].kind, AxisKind::depth) << one.name;
    EXPECT_THAT(source->info().grid.axes[2].coordinates, ElementsAre(5000, 500, 50, 5)) << one.name;
    EXPECT_EQ(volume_of(*source, "t").values[0], 250 + 3 * columns) << one.name;
  }
  write_auxiliary(folder / "n.nc", {"depth", "", "depth", {-5, -50, -500, -5000}});
  const auto source = opened(folder / "n.nc");
  EXPECT_EQ(source->info().grid.axes[2].kind, AxisKind::height);
  EXPECT_THAT(source->info().grid.axes[2].coordinates, ElementsAre(-5000, -500, -50, -5));
}

TEST(AuxiliaryLevels, ThicknessesAndLengthsWithoutADirectionPlaceNoLevels) {
  const Folder folder;
  for (const Auxiliary& one :
       {Auxiliary{"thick", "layer thickness", ""}, Auxiliary{"dz", "", "cell_thickness"},
        Auxiliary{"zz", "", ""}, Auxiliary{"depth_bnds", "", ""}}) {
    write_auxiliary(folder / "t.nc", one);
    const auto source = opened(folder / "t.nc");
    EXPECT_EQ(source->info().grid.axes[2].kind, AxisKind::level) << one.name;
    EXPECT_TRUE(has_note(source->info(), "the levels are not placed by '" + one.name + "'"));
  }
}

TEST(AuxiliaryLevels, OfOtherUnitsThanLengthsPlaceNoLevels) {
  const Folder folder;
  write_levels(folder / "k.nc", {{1, 2, 3, 4}, {20, 80, 200, 900}, "K"});
  const auto source = opened(folder / "k.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().grid.axes[2].kind, AxisKind::level);
}

TEST(AuxiliaryLevels, ThatAreNoPlacesAreNoted) {
  const Folder folder;
  write_levels(folder / "odd.nc", {{1, 2, 3, 4}, {20, 80, 80, 900}});
  const auto source = opened(folder / "odd.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().grid.axes[2].kind, AxisKind::level);
  EXPECT_TRUE(has_note(source->info(), "the levels are not placed by 'level_height'"));
}

// height = level_height + sigma * altitude; its mean over the columns has the mean altitude, 250 m.
TEST(AuxiliaryLevels, AFormulaGivesTheHeightOfEverySample) {
  const Folder folder;
  Levels levels;
  levels.is_formula = true;
  write_levels(folder / "hills.nc", levels);
  const auto source = opened(folder / "hills.nc");
  EXPECT_THAT(source->info().grid.axes[2].coordinates,
              ElementsAre(20 + 250, 80 + 225, 200 + 125, 900));
}

// Levels of the Unified Model: theta levels with uneven spacing, rho levels in their middles, both
// with the same numbers. Every field is its own height, so that it equals the axis where it is
// placed truly.
struct Shared {
  std::vector<double> theta{5, 21.5, 45, 75, 111.5};
  std::vector<double> rho{2.5, 13.25, 33.25, 60, 93.25};
  std::vector<std::string> at_theta{"air_temperature", "specific_humidity", "cloud"};
  std::vector<std::string> at_rho{"x_wind", "y_wind"};
  std::vector<std::string> nowhere;  // without `coordinates`
  std::vector<std::string> at_both;  // name the heights of both
  double rho_unit = 1;               // metres; 1000: km
  bool rho_first = false;
  bool falls = false;
};

void write_shared(const std::string& path, const Shared& one) {
  NetcdfMaker file(path);
  const std::size_t levels = one.theta.size();
  const int z = file.axis("model_level_number", counting(levels, 1), "1", "model_level_number");
  const auto put_heights = [&](const std::string& name, std::vector<double> values) {
    if (one.falls) std::reverse(values.begin(), values.end());
    const bool in_km = name == "level_height_0" && one.rho_unit == 1000;
    for (double& value : values) value /= in_km ? 1000 : 1;
    const int height = file.variable(name, NC_DOUBLE, {z}, values);
    file.text(height, "units", in_km ? "km" : "m");
    file.text(height, "positive", "up");
    file.text(height, "long_name", "level_height");
  };
  if (one.rho_first) put_heights("level_height_0", one.rho);
  put_heights("level_height", one.theta);
  if (!one.rho_first) put_heights("level_height_0", one.rho);
  const int y = file.axis("latitude", {50, 51}, "degrees_north");
  const int x = file.axis("longitude", {0, 1, 2}, "degrees_east");
  const auto put = [&](const std::string& name, const std::vector<double>& heights,
                       const std::string& coordinates) {
    std::vector<double> values;
    for (std::size_t k = 0; k < levels; ++k) {
      values.insert(values.end(), columns, heights[one.falls ? levels - 1 - k : k]);
    }
    const int v = file.variable(name, NC_FLOAT, {z, y, x}, values);
    file.text(v, "units", name.ends_with("wind") ? "m s-1" : "1");
    if (name.ends_with("wind")) file.text(v, "standard_name", name);
    if (!coordinates.empty()) file.text(v, "coordinates", coordinates);
  };
  for (const std::string& name : one.at_theta) put(name, one.theta, "level_height sigma");
  for (const std::string& name : one.at_rho) put(name, one.rho, "level_height_0 sigma_0");
  for (const std::string& name : one.nowhere) put(name, one.theta, "");
  for (const std::string& name : one.at_both) put(name, one.rho, "level_height level_height_0");
}

// Whether a field that is its own height equals the axis at all levels that it surrounds.
void expect_placed(Source& source, const std::string& name, std::size_t first, std::size_t end) {
  const std::vector<double>& z = source.info().grid.axes[2].coordinates;
  const Volume volume = volume_of(source, name);
  for (std::size_t k = first; k < end; ++k) {
    EXPECT_NEAR(volume.values[k * columns], z.at(k), 1e-5 * z.at(k)) << name << " level " << k;
  }
}

TEST(SharedLevels, VariablesThatNameNoneOfTwoHeightsOrBothAreLeftOut) {
  const Folder folder;
  Shared none;
  none.at_rho.clear();
  none.nowhere = {"x_wind", "y_wind"};
  write_shared(folder / "none.nc", none);
  EXPECT_THAT(reason_of(opened(folder / "none.nc")->info(), "x_wind"),
              testing::HasSubstr("several heights, of which it names none"));
  Shared both;
  both.at_rho = {"y_wind"};
  both.at_both = {"x_wind"};
  write_shared(folder / "both.nc", both);
  const auto source = opened(folder / "both.nc");
  EXPECT_THAT(reason_of(source->info(), "x_wind"),
              testing::HasSubstr("names several heights that differ"));
  expect_placed(*source, "y_wind", 0, 4);
}

TEST(SharedLevels, HeightsInOtherUnitsLieBetweenThose) {
  const Folder folder;
  Shared one;
  one.rho_unit = 1000;
  write_shared(folder / "km.nc", one);
  const auto source = opened(folder / "km.nc");
  ASSERT_EQ(reason_of(source->info(), "x_wind"), "");
  expect_placed(*source, "x_wind", 0, 4);
}

TEST(SharedLevels, TheLevelBeyondTheLastHeightIsMaskedAndNoted) {
  const Folder folder;
  write_shared(folder / "um.nc", {});
  const auto source = opened(folder / "um.nc");
  const Volume wind = volume_of(*source, "x_wind");
  for (std::size_t i = 0; i < columns; ++i) {
    EXPECT_FALSE(std::isnan(wind.values[3 * columns + i]));
    EXPECT_TRUE(std::isnan(wind.values[4 * columns + i])) << "no wind is above";
  }
  EXPECT_TRUE(has_note(source->info(), "interpolated by height"));
  EXPECT_TRUE(has_note(source->info(), "masked"));
}

TEST(SharedLevels, WindsBetweenUnevenLevelsAreInterpolatedToTheirHeights) {
  const Folder folder;
  for (const bool falls : {false, true}) {
    Shared levels;
    levels.falls = falls;
    write_shared(folder / "ukv.nc", levels);
    const auto source = opened(folder / "ukv.nc");
    EXPECT_THAT(source->info().grid.axes[2].coordinates, ElementsAre(5, 21.5, 45, 75, 111.5));
    expect_placed(*source, "air_temperature", 0, 5);
    expect_placed(*source, "x_wind", 0, 4);  // its highest level lies below the last
    EXPECT_TRUE(has_note(source->info(), "averaged to the centers of its cells: 'x_wind'"));
  }
}

TEST(SharedLevels, TheHeightsOfMostVariablesAreTheAxis) {
  const Folder folder;
  for (const bool rho_first : {false, true}) {
    Shared levels;
    levels.at_rho = {"x_wind", "y_wind", "air_pressure", "air_density"};
    levels.rho_first = rho_first;
    write_shared(folder / "rho.nc", levels);
    const auto source = opened(folder / "rho.nc");
    EXPECT_THAT(source->info().grid.axes[2].coordinates, ElementsAre(2.5, 13.25, 33.25, 60, 93.25));
    expect_placed(*source, "x_wind", 0, 5);
    expect_placed(*source, "air_temperature", 1, 5);  // its lowest level lies above the first
  }
}

TEST(SharedLevels, VariablesAtHeightsThatAreNotBetweenAreLeftOut) {
  const Folder folder;
  Shared levels;
  levels.rho = {12, 50, 100, 150, 200};
  levels.nowhere = {"soot"};
  write_shared(folder / "odd.nc", levels);
  const auto source = opened(folder / "odd.nc");
  EXPECT_EQ(source->info().find("x_wind"), nullptr);
  EXPECT_EQ(reason_of(source->info(), "x_wind"),
            "at the heights 'level_height_0', which do not lie between those of other variables on "
            "its levels ('level_height')");
  EXPECT_EQ(reason_of(source->info(), "soot"),
            "on levels that have several heights, of which it names none");
  EXPECT_TRUE(has_note(source->info(), "x_wind")) << "an absent wind is noted";
  expect_placed(*source, "air_temperature", 0, 5);
}

}  // namespace
}  // namespace windsplat::data::test
