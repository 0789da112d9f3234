// Members of ensembles, forecasts and bands: one entry of a dimension besides space and time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/data/files/files.hpp"
#include "tests/unit/data/cf/selected_maker.hpp"

namespace windsplat::data::test::entries {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(SelectedEntries, EveryMemberIsShownByItsValue) {
  const Folder folder;
  write_ensemble(folder / "e.nc");
  const std::vector<std::string> numbers{"3", "5", "9"};
  for (std::size_t m = 0; m < numbers.size(); ++m) {
    const auto source = opened((folder / "e.nc?number=") + numbers[m]);
    ASSERT_NE(source, nullptr);
    ASSERT_EQ(source->info().steps.size(), 2U);
    const double tag = static_cast<double>(m) * 10000;
    for (std::size_t step = 0; step < 2; ++step) {
      const Volume volume = volume_of(*source, "t", step);
      ASSERT_EQ(volume.dims, (std::array<int, 3>{4, 3, 2}));
      EXPECT_EQ(volume.values[0], tag + static_cast<double>(step) * 1000);
      EXPECT_EQ(last_of(volume), tag + static_cast<double>(step) * 1000 + 123);
    }
    EXPECT_EQ(last_of(volume_of(*source, "steady", 1)), 123);
    ASSERT_EQ(source->info().choices.size(), 1U);
    EXPECT_EQ(source->info().choices[0].chosen, numbers[m]);
    EXPECT_EQ(source->info().title, "e (number=" + numbers[m] + ")");
    EXPECT_FALSE(has_note(source->info(), "the first is shown"));
  }
}

// Files that begin with members 3 and 5: as a series along time, and with different variables.
TEST(SelectedEntries, FilesThatBeginWithDifferentMembersAreNotMixed) {
  const Folder folder;
  write_ensemble(folder / "e_1.nc");
  for (const auto& [name, variable] : {std::pair("e_2.nc", "t"), std::pair("q.nc", "q")}) {
    NetcdfMaker file(folder / name);
    const int n = file.axis("number", {5, 9}, "1", "realization");
    const double hour = std::string_view(variable) == "t" ? 12 : 0;
    const int t = file.axis("time", {hour, hour + 6}, "hours since 2001-01-01", "time");
    const auto [z, y, x] = space_of(file);
    file.variable(variable, NC_FLOAT, {n, t, z, y, x}, tagged({2, 2, 2, 3, 4}));
  }
  EXPECT_THAT(why_not(folder / "e_*.nc"), HasSubstr("its first 'number' is 5, not 3; choose one"));
  EXPECT_THAT(why_not(folder / "{e_1,q}.nc"), HasSubstr("its first 'number' is 5, not 3"));
  const auto series = opened(folder / "e_*.nc?number=5");
  ASSERT_NE(series, nullptr);
  EXPECT_EQ(last_of(volume_of(*series, "t", 0)), 10123);
  EXPECT_EQ(last_of(volume_of(*series, "t", 2)), 123);
}

TEST(SelectedEntries, WithoutAChoiceTheFirstIsShownAndNoted) {
  const Folder folder;
  write_ensemble(folder / "e.nc");
  const auto source = opened(folder / "e.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(last_of(volume_of(*source, "t")), 123);
  EXPECT_TRUE(has_note(source->info(),
                       "'number' has 3 entries (3 .. 9): the first is shown; choose another by "
                       "appending ?number=VALUE to the file's name"));
  ASSERT_EQ(source->info().choices.size(), 1U);
  EXPECT_EQ(source->info().choices[0].name, "number");
  EXPECT_EQ(source->info().choices[0].length, 3U);
  EXPECT_THAT(source->info().choices[0].values, ElementsAre("3", "5", "9"));
  EXPECT_EQ(source->info().title, "e");
  const auto other = opened(folder / "e.nc?number=5");
  ASSERT_NE(other, nullptr);
  EXPECT_NE(source->info().digest, other->info().digest);
}

TEST(SelectedEntries, WhatDoesNotExistIsRefusedWithWhatDoes) {
  const Folder folder;
  write_ensemble(folder / "e.nc");
  EXPECT_EQ(why_not(folder / "e.nc?number=4"),
            "'e.nc': the dimension 'number' has no entry '4': it has 3 entries (3 .. 9)");
  EXPECT_EQ(why_not(folder / "e.nc?member=3"),
            "'e.nc': there is no dimension 'member': there are 'number' (3), 'time' (2), 'lev' "
            "(2), 'lat' (3), 'lon' (4)");
  EXPECT_THAT(why_not(folder / "e.nc?=3"), HasSubstr("has a choice without a name"));
  EXPECT_THAT(why_not(folder / "e.nc?number="), HasSubstr("has a choice without a value"));
  EXPECT_THAT(why_not(folder / "e.nc?number=3&number=5"), HasSubstr("chooses 'number' twice"));
  EXPECT_THAT(why_not(folder / "e.nc?number=3?time=0"), HasSubstr("has two selections"));
  EXPECT_THAT(why_not(folder / "none.nc?number=3"), HasSubstr("none.nc': no such file"));
  EXPECT_THAT(why_not(folder / "e?number=3"), HasSubstr("no such file"));
  std::string many = folder / "e.nc?d0=0";
  for (int n = 1; n <= 16; ++n) many += "&d" + std::to_string(n) + "=0";
  EXPECT_THAT(why_not(many), HasSubstr("has more than 16 choices"));
}

TEST(SelectedEntries, AFileWhoseNameLooksLikeASelectionWins) {
  const Folder folder;
  write_ensemble(folder / "e.nc");
  std::filesystem::rename(folder / "e.nc", folder / "e.nc?number=5");
  const auto source = opened(folder / "e.nc?number=5");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().choices[0].chosen, "3");
}

TEST(SelectedEntries, SpaceAndTimeMayBeChosenToo) {
  const Folder folder;
  write_ensemble(folder / "e.nc");
  const auto source = opened(folder / "e.nc?number=9&lev=500&time=2001-01-01T06:00:00Z");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().steps.size(), 1U);
  const Volume volume = volume_of(*source, "t");
  ASSERT_EQ(volume.dims, (std::array<int, 3>{4, 3, 1}));
  EXPECT_EQ(volume.values[0], 21100);
  EXPECT_EQ(last_of(volume), 21123);
}

TEST(SelectedEntries, AChosenLevelStaysInItsPlace) {
  const Folder folder;
  write_ensemble(folder / "e.nc");
  const auto source = opened(folder / "e.nc?number=9&lev=500");
  ASSERT_NE(source, nullptr);
  const Axis& z = source->info().grid.axes[2];
  EXPECT_EQ(z.name, "lev");
  EXPECT_EQ(z.kind, AxisKind::pressure);
  EXPECT_EQ(z.units, "hPa");
  EXPECT_EQ(z.coordinates, std::vector<double>{500});
}

// t(time, lev, lat, lon) beside pr(time, lat, lon) and pr_day(day, lat, lon).
// Fields of the surface beside fields of levels, first in the file.
void write_surface_and_levels(const std::string& path) {
  NetcdfMaker file(path);
  const Space space = space_of(file);
  const auto add = [&](const char* name, const char* units, const char* standard_name, bool high,
                       double value) {
    const int v =
        file.variable(name, NC_FLOAT,
                      high ? std::vector{space.z, space.y, space.x} : std::vector{space.y, space.x},
                      std::vector<double>(high ? 24 : 12, value));
    file.text(v, "units", units);
    file.text(v, "standard_name", standard_name);
  };
  add("tas", "K", "air_temperature", false, 300);
  add("huss", "1", "specific_humidity", false, 0.01);
  add("v10", "m s-1", "northward_wind", false, 2);
  add("ta", "K", "air_temperature", true, 250);
  add("ua", "m s-1", "eastward_wind", true, 3);
  add("va", "m s-1", "northward_wind", true, 4);
  add("wap", "Pa s-1", "lagrangian_tendency_of_air_pressure", true, -1);
}

TEST(SelectedEntries, FieldsWithoutTheChosenLevelHaveNotItsPressure) {
  const Folder folder;
  write_surface_and_levels(folder / "p.nc");
  const auto source = opened(folder / "p.nc?lev=500");
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.grid.axes[2].coordinates, std::vector<double>{500});
  EXPECT_EQ(info.find("relative_humidity"), nullptr);
  EXPECT_TRUE(has_note(info, "not at the chosen level 'lev': 'tas', 'huss', 'v10'"));
  const FieldInfo* wind = info.find("wind");
  ASSERT_NE(wind, nullptr);
  EXPECT_THAT(wind->components, ElementsAre("ua", "va", "wap"));
  // -omega R T / (p g), with the temperature of the level.
  const Volume volume = volume_of(*source, "wind_m");
  EXPECT_NEAR(last_of(volume), 287.05 * 250 / (50000 * 9.80665), 1e-4);
}

TEST(SelectedEntries, AGridWithoutTheChosenLevelHasNoLevel) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "o.nc");
    const auto [z, y, x] = space_of(file);
    file.variable("ua", NC_FLOAT, {z, y, x}, tagged({2, 3, 4}));
    const int north = file.axis("lat2", counting(9), "degrees_north", "latitude");
    const int east = file.axis("lon2", counting(9), "degrees_east", "longitude");
    file.variable("orog", NC_FLOAT, {north, east}, tagged({9, 9}));
  }
  const auto other = opened(folder / "o.nc?field=orog&lev=500");
  ASSERT_NE(other, nullptr);
  EXPECT_EQ(other->info().grid.axes[2].coordinates, std::vector<double>{0});
  EXPECT_NE(other->info().grid.axes[2].kind, AxisKind::pressure);
  EXPECT_TRUE(has_note(other->info(), "by appending &field=ua"));
  const auto own = opened(folder / "o.nc?field=ua&lev=500");
  ASSERT_NE(own, nullptr);
  EXPECT_EQ(own->info().grid.axes[2].coordinates, std::vector<double>{500});
}

TEST(SelectedEntries, FieldsOnAnotherGridAreShownByName) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "m.nc");
    const int t = file.axis("time", {0, 6}, "hours since 2001-01-01", "time");
    const int day = file.axis("day", {0}, "days since 2001-01-01", "time");
    const auto [z, y, x] = space_of(file);
    file.variable("t", NC_FLOAT, {t, z, y, x}, tagged({2, 2, 3, 4}));
    file.variable("pr", NC_FLOAT, {t, y, x}, tagged({2, 3, 4}));
    file.variable("ps", NC_FLOAT, {t, y, x}, tagged({2, 3, 4}));
    file.variable("pr_day", NC_FLOAT, {day, y, x}, tagged({1, 3, 4}));
    file.variable("lat_bnds", NC_DOUBLE, {y, file.dimension("bnds", 2)}, tagged({3, 2}));
    file.text(file.variable_id("lat"), "bounds", "lat_bnds");
  }
  const auto all = opened(folder / "m.nc");
  ASSERT_NE(all, nullptr);
  EXPECT_NE(all->info().find("t"), nullptr);
  EXPECT_EQ(all->info().find("pr"), nullptr);
  EXPECT_TRUE(has_note(all->info(),
                       "fields on another grid are shown by appending ?field=pr to the file's"));
  const auto flat = opened(folder / "m.nc?field=pr");
  ASSERT_NE(flat, nullptr);
  EXPECT_EQ(flat->info().find("t"), nullptr);
  EXPECT_NE(flat->info().find("ps"), nullptr);
  ASSERT_EQ(flat->info().steps.size(), 2U);
  EXPECT_EQ(flat->info().title, "m (field=pr)");
  const Volume volume = volume_of(*flat, "pr", 1);
  ASSERT_EQ(volume.dims, (std::array<int, 3>{4, 3, 1}));
  EXPECT_EQ(last_of(volume), 123);
  const auto daily = opened(folder / "m.nc?field=pr_day");
  ASSERT_NE(daily, nullptr);
  EXPECT_NE(daily->info().find("pr_day"), nullptr) << "its own time";
  EXPECT_THAT(why_not(folder / "m.nc?field=nothing"), HasSubstr("there is no field 'nothing'"));
  EXPECT_THAT(why_not(folder / "m.nc?field=lat_bnds"),
              HasSubstr("'lat_bnds' cannot be shown: bounds of a coordinate"));
  std::filesystem::copy(folder / "m.nc", folder / "m_2.nc");
  const auto series = opened(folder / "m*.nc?field=pr");
  ASSERT_NE(series, nullptr);
  EXPECT_EQ(last_of(volume_of(*series, "pr", 1)), 123);
}

TEST(SelectedEntries, BandsWithoutACoordinateAreNumberedFromZero) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "bins.nc");
    const int b = file.dimension("bin", 3);
    const int t = file.axis("time", {0, 1}, "hours since 2001-01-01");
    const auto [z, y, x] = space_of(file);
    file.variable("mass", NC_FLOAT, {b, t, z, y, x}, tagged({3, 2, 2, 3, 4}));
  }
  const auto first = opened(folder / "bins.nc");
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(last_of(volume_of(*first, "mass", 1)), 1123);
  EXPECT_THAT(first->info().choices[0].values, ElementsAre("0", "1", "2"));
  const auto third = opened(folder / "bins.nc?bin=2");
  ASSERT_NE(third, nullptr);
  EXPECT_EQ(last_of(volume_of(*third, "mass", 1)), 21123);
  EXPECT_THAT(why_not(folder / "bins.nc?bin=3"),
              HasSubstr("has no entry '3': it has 3 entries (0 .. 2)"));
  EXPECT_THAT(why_not(folder / "bins.nc?bin=0.5"), HasSubstr("has no entry '0.5'"));
  EXPECT_THAT(why_not(folder / "bins.nc?bin=-1"), HasSubstr("has no entry '-1'"));
}

TEST(SelectedEntries, SinglePrecisionValuesAreNamedAsTheyWereWritten) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "waves.nc");
    const int b = file.dimension("wavelength", 2);
    file.variable("wavelength", NC_FLOAT, {b}, {0.1, 0.55});
    const auto [z, y, x] = space_of(file);
    file.variable("aerosol", NC_FLOAT, {b, z, y, x}, tagged({2, 2, 3, 4}));
  }
  const auto first = opened(folder / "waves.nc?wavelength=0.10");
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(last_of(volume_of(*first, "aerosol")), 123);
  const auto source = opened(folder / "waves.nc?wavelength=0.55");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(last_of(volume_of(*source, "aerosol")), 1123);
  EXPECT_THAT(source->info().choices[0].values, ElementsAre("0.1", "0.55"));
}

TEST(SelectedEntries, NumbersBeyondSinglePrecisionNameNoEntry) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "f.nc");
    const int m = file.dimension("scale", 2);
    file.variable("scale", NC_FLOAT, {m}, {1, 2});
    const auto [z, y, x] = space_of(file);
    file.variable("t", NC_FLOAT, {m, z, y, x}, tagged({2, 2, 3, 4}));
  }
  // The library refuses to convert an infinite double.
  int id = -1;
  int scale = -1;
  const std::array<float, 2> values{1, std::numeric_limits<float>::infinity()};
  ASSERT_EQ(nc_open((folder / "f.nc").c_str(), NC_WRITE, &id), NC_NOERR);
  ASSERT_EQ(nc_inq_varid(id, "scale", &scale), NC_NOERR);
  ASSERT_EQ(nc_put_var_float(id, scale, values.data()), NC_NOERR);
  ASSERT_EQ(nc_close(id), NC_NOERR);
  EXPECT_THAT(why_not(folder / "f.nc?scale=1e300"), HasSubstr("no entry '1e300'"));
  EXPECT_NE(opened(folder / "f.nc?scale=inf"), nullptr);
}

TEST(SelectedEntries, AnAxisOfAnotherVariableIsNotChosen) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "both.nc");
    const int b = file.dimension("layer_of_soil", 2);
    const auto [z, y, x] = space_of(file);
    file.variable("soil", NC_FLOAT, {b, y, x}, tagged({2, 3, 4}));
    file.variable("odd", NC_FLOAT, {b, z, y, x}, tagged({2, 2, 3, 4}));
  }
  const auto source = opened(folder / "both.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(source->info().choices.empty());
  EXPECT_EQ(reason_of(source->info(), "odd"), "it has more than three spatial dimensions");
  const auto chosen = opened(folder / "both.nc?layer_of_soil=1");
  ASSERT_NE(chosen, nullptr);
  EXPECT_EQ(last_of(volume_of(*chosen, "odd")), 1123);
}

TEST(SelectedEntries, CornersOfCellsAreNotMembers) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "corners.nc");
    const int corners = file.dimension("nv", 4);
    const auto [z, y, x] = space_of(file);
    file.variable("t", NC_FLOAT, {z, y, x}, tagged({2, 3, 4}));
    file.variable("area", NC_FLOAT, {y, x, corners}, tagged({3, 4, 4}));
  }
  const auto source = opened(folder / "corners.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(source->info().choices.empty());
  EXPECT_EQ(reason_of(source->info(), "area"), "its dimension 'nv' is neither space nor time");
}

TEST(SelectedEntries, ASeriesShowsOneMemberOfEveryFile) {
  const Folder folder;
  write_ensemble(folder / "e_1.nc", 0);
  write_ensemble(folder / "e_2.nc", 12);
  for (const char* pattern : {"e_*.nc?number=9", "e_?.nc?number=9"}) {
    const auto source = opened(folder / pattern);
    ASSERT_NE(source, nullptr) << pattern;
    EXPECT_EQ(last_of(volume_of(*source, "steady")), 123) << pattern;
    EXPECT_EQ(last_of(volume_of(*source, "t", 1)), 21123) << pattern;
    EXPECT_EQ(source->info().choices.at(0).chosen, "9") << pattern;
  }
  const auto series = opened(folder / "e_*.nc?number=9");
  ASSERT_NE(series, nullptr);
  EXPECT_EQ(series->info().steps.size(), 4U);
  EXPECT_EQ(last_of(volume_of(*series, "t", 3)), 21123);
  EXPECT_THAT(why_not(folder / "e_*.nc?member=9"), HasSubstr("there is no dimension 'member'"));
}

TEST(SelectedEntries, PartsOfADatasetMayLackTheDimension) {
  const Folder folder;
  write_ensemble(folder / "m_t.nc");
  {
    NetcdfMaker file(folder / "m_oro.nc");
    const auto [z, y, x] = space_of(file);
    file.variable("oro", NC_FLOAT, {z, y, x}, tagged({2, 3, 4}));
  }
  const auto source = opened(folder / "m_{oro,t}.nc?number=5");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(last_of(volume_of(*source, "t", 1)), 11123);
  EXPECT_EQ(last_of(volume_of(*source, "oro")), 123);
}

TEST(SelectedEntries, AMemberOfAGroup) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "g.nc");
    int group = 0;
    std::array<int, 4> dims{};
    ASSERT_EQ(nc_def_grp(file.id(), "runs", &group), NC_NOERR);
    const std::array<std::size_t, 4> lengths{2, 2, 3, 4};
    const std::array<const char*, 4> names{"member", "z", "y", "x"};
    for (std::size_t d = 0; d < 4; ++d) {
      ASSERT_EQ(nc_def_dim(group, names.at(d), lengths.at(d), &dims.at(d)), NC_NOERR);
    }
    int variable = 0;
    ASSERT_EQ(nc_def_var(group, "t", NC_FLOAT, 4, dims.data(), &variable), NC_NOERR);
    const std::vector<double> values = tagged({2, 2, 3, 4});
    ASSERT_EQ(nc_put_var_double(group, variable, values.data()), NC_NOERR);
  }
  const auto source = opened(folder / "g.nc#/runs?member=1");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(last_of(volume_of(*source, "t")), 1123);
}

TEST(SelectedEntries, APathBelowTheDataRootHasThemToo) {
  const Folder folder;
  write_ensemble(folder / "e.nc");
  const auto one = locate_beneath(folder / "", "e.nc?number=5&time=6");
  ASSERT_TRUE(one) << one.error().message;
  ASSERT_EQ(one->selection.size(), 2U);
  EXPECT_EQ(one->selection[0].dimension, "number");
  EXPECT_EQ(one->selection[0].value, "5");
  EXPECT_EQ(one->wanted_id(), "e,number=5,time=6");
  const auto series = locate_beneath(folder / "", "e*?number=5");
  ASSERT_TRUE(series) << series.error().message;
  const auto again = locate_again(*series);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->wanted_id(), series->wanted_id());
  EXPECT_EQ(locate_beneath(folder / "", "e.nc?=5").error().kind, ErrorKind::invalid);
  EXPECT_EQ(locate_beneath(folder / "", "e.nc?a=1?b=2").error().kind, ErrorKind::invalid);
  EXPECT_EQ(locate_beneath(folder / "", "f.nc?number=5").error().kind, ErrorKind::not_found);
}

}  // namespace
}  // namespace windsplat::data::test::entries
