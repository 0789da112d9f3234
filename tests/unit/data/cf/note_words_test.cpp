// Notes and lists of omissions name what the file has, and do not contradict each other.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(NoteWords, HeightsOfSamplesAreNamedAsInTheFile) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "icon.nc");
    const int z = file.axis("lev", {1, 2, 3}, "");
    file.text(file.variable_id("lev"), "axis", "Z");
    const int y = file.axis("lat", {50, 51}, "degrees_north");
    const int x = file.axis("lon", {0, 1, 2}, "degrees_east");
    const int heights = file.variable("z_mc", NC_FLOAT, {z, y, x}, counting(18, 100));
    file.text(heights, "units", "m");
    file.text(heights, "standard_name", "altitude");
    file.text(file.variable("t", NC_FLOAT, {z, y, x}, counting(18)), "units", "K");
  }
  const auto source = opened(folder / "icon.nc");
  EXPECT_TRUE(has_note(source->info(), "the field 'z_mc' has the height of every sample"));
  EXPECT_FALSE(has_note(source->info(), "\"height\""));
}

// As older files of ICON call z_mc. A height above sea level in the file has precedence.
TEST(NoteWords, HeightsNamedHeightPlaceTheLevels) {
  const Folder folder;
  for (const bool with_altitude : {false, true}) {
    {
      NetcdfMaker file(folder / "icon.nc");
      const int z = file.axis("lev", {1, 2, 3}, "");
      const int y = file.axis("lat", {50, 51}, "degrees_north");
      const int x = file.axis("lon", {0, 1, 2}, "degrees_east");
      const int heights = file.variable("z_mc", NC_FLOAT, {z, y, x}, counting(18, 100));
      file.text(heights, "units", "m");
      file.text(heights, "standard_name", "height");
      if (with_altitude) {
        const int altitude = file.variable("zsl", NC_FLOAT, {z, y, x}, counting(18, 500));
        file.text(altitude, "units", "m");
        file.text(altitude, "standard_name", "altitude");
      }
    }
    const auto source = opened(folder / "icon.nc");
    // Six samples a level, of consecutive numbers from 100 or 500.
    const double first = with_altitude ? 502.5 : 102.5;
    EXPECT_THAT(source->info().grid.axes[2].coordinates,
                testing::ElementsAre(first, first + 6, first + 12));
    EXPECT_EQ(source->info().grid.axes[2].standard_name, with_altitude ? "altitude" : "height");
    EXPECT_TRUE(has_note(source->info(), with_altitude ? "the field 'zsl' has the height"
                                                       : "the field 'z_mc' has the height"));
  }
}

TEST(NoteWords, PositionsInUseAreNotOmitted) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "wrf.nc");
    const int t = file.dimension("Time", 1);
    const int y = file.dimension("south_north", 2);
    const int x = file.dimension("west_east", 3);
    file.text(file.variable("XLONG", NC_FLOAT, {t, y, x}, {10, 11, 12, 10, 11, 12}), "units",
              "degree_east");
    file.text(file.variable("XLAT", NC_FLOAT, {t, y, x}, {50, 50, 50, 51, 51, 51}), "units",
              "degree_north");
    file.text(file.variable("T2", NC_FLOAT, {t, y, x}, counting(6)), "units", "K");
  }
  const auto source = opened(folder / "wrf.nc");
  ASSERT_NE(source->info().grid.columns, nullptr);
  for (const char* name : {"XLAT", "XLONG", "south_north", "west_east"}) {
    EXPECT_EQ(reason_of(source->info(), name), "") << name;
  }
  EXPECT_TRUE(has_note(source->info(), "'XLAT' is given for every step"));
}

TEST(NoteWords, AFieldWithACodeIsNoMapProjection) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "code.nc");
    const int y = file.axis("y", {5000000, 5001000}, "m", "projection_y_coordinate");
    const int x = file.axis("x", {400000, 401000, 402000}, "m", "projection_x_coordinate");
    const int ua = file.variable("ua", NC_FLOAT, {y, x}, counting(6));
    file.text(ua, "units", "m s-1");
    file.text(ua, "epsg_code", "EPSG:32633");
  }
  const auto source = opened(folder / "code.nc");
  EXPECT_TRUE(has_note(source->info(), "the map projection of 'ua' "));
}

// Two fields of these names and units, and standard names unless empty.
std::string notes_of_two(const Folder& folder, const std::array<std::string, 2>& names,
                         const std::string& units, const std::array<std::string, 2>& standard) {
  {
    NetcdfMaker file(folder / "two.nc");
    const int y = file.axis("y", {0, 1}, "m");
    const int x = file.axis("x", {0, 1, 2}, "m");
    for (std::size_t n = 0; n < names.size(); ++n) {
      const int field = file.variable(names.at(n), NC_FLOAT, {y, x}, counting(6));
      file.text(field, "units", units);
      if (!standard.at(n).empty()) file.text(field, "standard_name", standard.at(n));
    }
  }
  std::string all;
  const auto source = opened(folder / "two.nc");
  for (const std::string& note : source->info().notes) all += note + '\n';
  return all;
}

TEST(NoteWords, VelocitiesOfUnknownNamesAreToldOnlyIfNoVectorWasFound) {
  const Folder folder;
  for (const char* const units : {"m/s", "cm s-1", "mm/s"}) {
    EXPECT_THAT(notes_of_two(folder, {"alpha", "beta"}, units, {}),
                HasSubstr("no vector field was found: if 'alpha', 'beta' are components"))
        << units;
  }
  const auto silent = Not(HasSubstr("no vector field"));
  EXPECT_THAT(notes_of_two(folder, {"alpha", "beta"}, "m/s", {"x_wind", "y_wind"}), silent);
  EXPECT_THAT(notes_of_two(folder, {"alpha", "beta"}, "K", {}), silent);
  EXPECT_THAT(notes_of_two(folder, {"speed_10m", "gust"}, "m/s", {}), silent);
  EXPECT_THAT(notes_of_two(folder, {"a", "b"}, "m/s", {"rainfall_rate", "snowfall_flux"}), silent);
}

}  // namespace
}  // namespace windsplat::data::test
