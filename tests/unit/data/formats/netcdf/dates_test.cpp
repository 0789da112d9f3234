// The text variables Times of WRF and xtime of MPAS as the times of steps.
#include "server/data/formats/netcdf/dates.hpp"

#include <gtest/gtest.h>
#include <netcdf.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

// One field at the dates; with XTIME if minutes are given.
void write_dates(const std::string& path, const std::vector<std::string>& dates, int mode,
                 const std::vector<double>& minutes = {},
                 const std::string& epoch = "2000-01-01 00:00:00",
                 const std::string& name = "Times") {
  NetcdfMaker file(path, mode);
  const int time = file.dimension("Time", dates.size());
  const int width = file.dimension("DateStrLen", dates.front().size());
  const int y = file.axis("y", {0, 1, 2}, "m");
  const int x = file.axis("x", {0, 1}, "m");
  const int text = file.variable(name, NC_CHAR, {time, width});
  file.variable("T", NC_FLOAT, {time, y, x}, counting(6 * dates.size()));
  if (!minutes.empty()) {
    file.text(file.variable("XTIME", NC_FLOAT, {time}, minutes), "units", "minutes since " + epoch);
  }
  nc_enddef(file.id());
  std::string all;
  for (const std::string& date : dates) all += date;
  EXPECT_EQ(nc_put_var_text(file.id(), text, all.data()), NC_NOERR);
}

std::vector<std::string> times_of(const std::string& path) {
  std::vector<std::string> out;
  const auto source = opened(path);
  if (source == nullptr) return out;
  for (const TimeStep& step : source->info().steps) out.push_back(step.text);
  return out;
}

TEST(WrfDates, TimesOfStepsAreReadFromTheText) {
  const Folder folder;
  for (const int mode : {NC_NETCDF4, NC_64BIT_OFFSET}) {
    write_dates(folder / "wrfout.nc", {"2004-02-28_21:00:00", "2004-02-29_00:30:00"}, mode);
    EXPECT_EQ(times_of(folder / "wrfout.nc"),
              (std::vector<std::string>{"2004-02-28T21:00:00Z", "2004-02-29T00:30:00Z"}));
  }
}

TEST(WrfDates, NumericTimesHavePrecedence) {
  const Folder folder;
  write_dates(folder / "x.nc", {"2004-02-28_21:00:00", "2004-02-29_00:30:00"}, NC_NETCDF4, {0, 60});
  EXPECT_EQ(times_of(folder / "x.nc"),
            (std::vector<std::string>{"2000-01-01T00:00:00Z", "2000-01-01T01:00:00Z"}));
}

TEST(WrfDates, TimesSinceNoDateLeaveTheTextInForce) {
  const Folder folder;
  write_dates(folder / "x.nc", {"2004-02-28_21:00:00", "2004-02-29_00:30:00"}, NC_NETCDF4, {0, 60},
              "simulation start");
  EXPECT_EQ(times_of(folder / "x.nc"),
            (std::vector<std::string>{"2004-02-28T21:00:00Z", "2004-02-29T00:30:00Z"}));
}

TEST(WrfDates, YearOneOfIdealisedRunsIsThatOfTheText) {
  const Folder folder;
  write_dates(folder / "ideal.nc", {"0001-01-01_00:00:00", "0001-01-01_00:10:00"}, NC_NETCDF4);
  EXPECT_EQ(times_of(folder / "ideal.nc"),
            (std::vector<std::string>{"0001-01-01T00:00:00Z", "0001-01-01T00:10:00Z"}));
}

TEST(WrfDates, FractionsOfSecondsAreRead) {
  const Folder folder;
  write_dates(folder / "f.nc", {"2004-02-28_21:00:00.5000", "2004-02-28_21:00:00.7500"},
              NC_NETCDF4);
  EXPECT_EQ(times_of(folder / "f.nc"),
            (std::vector<std::string>{"2004-02-28T21:00:00.500Z", "2004-02-28T21:00:00.750Z"}));
}

TEST(WrfDates, FilesOfASeriesAreInTheOrderOfTheirDates) {
  const Folder folder;
  write_dates(folder / "s_1.nc", {"2004-03-01_00:00:00"}, NC_NETCDF4);
  write_dates(folder / "s_2.nc", {"2004-02-29_00:00:00"}, NC_NETCDF4);
  EXPECT_EQ(times_of(folder / "s_*.nc"),
            (std::vector<std::string>{"2004-02-29T00:00:00Z", "2004-03-01T00:00:00Z"}));
}

TEST(WrfDates, TextThatIsNoDateNumbersTheStepsWithAReason) {
  const Folder folder;
  write_dates(folder / "bad.nc", {"2004-02-28_21:00:00", "2003-02-29_00:00:00"}, NC_NETCDF4);
  EXPECT_EQ(times_of(folder / "bad.nc"), (std::vector<std::string>{"0", "1"}));
  EXPECT_EQ(
      reason_of(opened(folder / "bad.nc")->info(), "Time"),
      "the text of 'Times' is no date of the calendar proleptic_gregorian at step 1: steps are "
      "numbered");
}

TEST(WrfDates, BlankEntriesAreCounted) {
  const Folder folder;
  const std::string blank(19, ' ');
  write_dates(folder / "bad.nc", {"2004-02-28_21:00:00", blank, "2004-02-28_23:00:00", blank},
              NC_NETCDF4);
  EXPECT_EQ(times_of(folder / "bad.nc"), (std::vector<std::string>{"0", "1", "2", "3"}));
  EXPECT_EQ(
      reason_of(opened(folder / "bad.nc")->info(), "Time"),
      "the text of 'Times' is no date of the calendar proleptic_gregorian at 2 steps, first at "
      "step 1: steps are numbered");
}

// MPAS writes 64 characters, with blanks or zeros behind the date.
TEST(WrfDates, TextOfMpasIsRead) {
  const Folder folder;
  for (const char rest : {' ', '\0'}) {
    std::vector<std::string> dates;
    for (const char* date : {"0004-02-28_21:00:00", "0004-02-29_00:30:00"}) {
      dates.push_back(date + std::string(45, rest));
    }
    write_dates(folder / "history.nc", dates, NC_64BIT_DATA, {}, "", "xtime");
    EXPECT_EQ(times_of(folder / "history.nc"),
              (std::vector<std::string>{"0004-02-28T21:00:00Z", "0004-02-29T00:30:00Z"}));
    EXPECT_TRUE(has_note(opened(folder / "history.nc")->info(), "the text of 'xtime'"));
  }
}

// One field of MPAS at the dates, with config_calendar_type.
void write_mpas(const std::string& path, const std::vector<std::string>& dates,
                const std::string& calendar) {
  NetcdfMaker file(path, NC_64BIT_DATA);
  file.text(NC_GLOBAL, "config_calendar_type", calendar);
  const int time = file.dimension("Time", dates.size());
  const int width = file.dimension("StrLen", 64);
  const int y = file.axis("y", {0, 1, 2}, "m");
  const int x = file.axis("x", {0, 1}, "m");
  const int text = file.variable("xtime", NC_CHAR, {time, width});
  file.variable("T", NC_FLOAT, {time, y, x}, counting(6 * dates.size()));
  nc_enddef(file.id());
  std::string all;
  for (const std::string& date : dates) all += date + std::string(64 - date.size(), ' ');
  EXPECT_EQ(nc_put_var_text(file.id(), text, all.data()), NC_NOERR);
}

TEST(MpasDates, DatesOfACalendarOf360DaysAreRead) {
  const Folder folder;
  const std::string path = folder / "history.nc";
  write_mpas(path, {"0000-02-29_00:00:00", "0000-02-30_00:00:00", "0000-03-01_00:00:00"}, "360day");
  EXPECT_EQ(times_of(path),
            (std::vector<std::string>{"0000-02-29T00:00:00Z", "0000-02-30T00:00:00Z",
                                      "0000-03-01T00:00:00Z"}));
  const auto source = opened(path);
  EXPECT_EQ(source->info().time_calendar, "360_day");
  EXPECT_EQ(source->info().steps[2].value - source->info().steps[0].value, 2 * 86400.0);
}

TEST(MpasDates, WithoutLeapDaysMarchFollowsOnThe28thOfFebruary) {
  const Folder folder;
  const std::string path = folder / "history.nc";
  write_mpas(path, {"0004-02-28_00:00:00", "0004-03-01_00:00:00"}, "gregorian_noleap");
  EXPECT_EQ(times_of(path),
            (std::vector<std::string>{"0004-02-28T00:00:00Z", "0004-03-01T00:00:00Z"}));
  const auto source = opened(path);
  EXPECT_EQ(source->info().steps[1].value - source->info().steps[0].value, 86400.0);
  EXPECT_TRUE(has_note(source->info(), "the text of 'xtime', calendar noleap"));
}

TEST(MpasDates, ADayThatTheCalendarLacksIsNamed) {
  const Folder folder;
  const std::string path = folder / "history.nc";
  write_mpas(path, {"0004-02-28_00:00:00", "0004-02-29_00:00:00"}, "gregorian_noleap");
  EXPECT_EQ(times_of(path), (std::vector<std::string>{"0", "1"}));
  EXPECT_EQ(reason_of(opened(path)->info(), "Time"),
            "the text of 'xtime' is no date of the calendar noleap at step 1: steps are numbered");
}

TEST(MpasDates, AnUnknownCalendarNumbersTheSteps) {
  const Folder folder;
  const std::string path = folder / "history.nc";
  write_mpas(path, {"0004-02-28_00:00:00", "0004-02-29_00:00:00"}, "mayan");
  EXPECT_EQ(times_of(path), (std::vector<std::string>{"0", "1"}));
  EXPECT_EQ(reason_of(opened(path)->info(), "xtime"),
            "the calendar of its dates, the attribute 'config_calendar_type' 'mayan', is unknown: "
            "steps are numbered");
}

TEST(WrfDates, SecondsCountFrom1970) {
  const auto seconds = [](const char* text) {
    return netcdf::seconds_of_date(text, cf::Calendar::proleptic_gregorian);
  };
  EXPECT_EQ(seconds("1970-01-01_00:00:00"), 0);
  EXPECT_EQ(seconds("2000-03-01_12:00:01"), 951912001);
  EXPECT_EQ(seconds("1969-12-31_23:59:59"), -1);
  EXPECT_EQ(seconds("1970-01-01_00:00:01.25 "), 1.25);
  EXPECT_EQ(seconds("1970-01-01T00:00:01Z"), 1);
  for (const char* text : {"1970-01-01_00:00:00+06", "1970-01-01_00:00:00.", "", "2000-03-01",
                           "2000-13-01_00:00:00", "2001-02-29_00:00:00", "2000-03-01_25:00:00",
                           "2000-03-0a_00:00:00", "-200-03-01_00:00:00"}) {
    EXPECT_TRUE(std::isnan(seconds(text))) << text;
  }
}

}  // namespace
}  // namespace windsplat::data::test
