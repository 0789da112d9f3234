// Lead and reference times of forecasts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "tests/unit/data/cf/selected_maker.hpp"

namespace windsplat::data::test::entries {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// t(reference, lead, lev, lat, lon), with valid times or without.
void write_forecast(const std::string& path, bool valid_times) {
  NetcdfMaker file(path);
  const int r = file.axis("reftime", {0, 24}, "hours since 2001-01-01", "forecast_reference_time");
  const int l = file.axis("leadtime", {0, 6, 12}, "hours", "forecast_period");
  const auto [z, y, x] = space_of(file);
  if (valid_times) {
    const int valid = file.variable("valid_time", NC_DOUBLE, {r, l}, {0, 6, 12, 24, 30, 36});
    file.text(valid, "units", "hours since 2001-01-01");
    file.text(valid, "standard_name", "time");
  }
  file.variable("t", NC_FLOAT, {r, l, z, y, x}, tagged({2, 3, 2, 3, 4}));
}

TEST(SelectedEntries, LeadTimesAreStepsWithTheirValidTimes) {
  const Folder folder;
  write_forecast(folder / "f.nc", true);
  const auto source = opened(folder / "f.nc?reftime=2001-01-02T00:00:00Z");
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 3U);
  EXPECT_EQ(source->info().steps[0].text, "2001-01-02T00:00:00Z");
  EXPECT_EQ(source->info().steps[2].text, "2001-01-02T12:00:00Z");
  EXPECT_EQ(source->info().time_units, "hours since 2001-01-01");
  EXPECT_EQ(last_of(volume_of(*source, "t", 2)), 12123);
  EXPECT_TRUE(has_note(source->info(), "valid times 'valid_time' of the lead times 'leadtime'"));
  const auto first = opened(folder / "f.nc");
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->info().steps[2].text, "2001-01-01T12:00:00Z");
  EXPECT_EQ(last_of(volume_of(*first, "t", 2)), 2123);
  EXPECT_TRUE(has_note(first->info(),
                       "'reftime' has 2 entries (2001-01-01T00:00:00Z .. "
                       "2001-01-02T00:00:00Z): the first is shown"));
}

TEST(SelectedEntries, LeadTimesFollowTheChosenReferenceTime) {
  const Folder folder;
  write_forecast(folder / "f.nc", false);
  const auto source = opened(folder / "f.nc?reftime=24");
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 3U);
  EXPECT_EQ(source->info().steps[1].value, 30);
  EXPECT_EQ(source->info().steps[1].text, "2001-01-02T06:00:00Z");
  EXPECT_EQ(source->info().time_units, "hours since 2001-01-01");
  EXPECT_EQ(last_of(volume_of(*source, "t", 1)), 11123);
  EXPECT_TRUE(has_note(source->info(),
                       "time steps are the lead times 'leadtime' after the reference time "
                       "2001-01-02T00:00:00Z"));
  EXPECT_TRUE(source->info().left_out.empty());
}

// A forecast of two steps, with a single reference time in days. Times in half days.
void write_one_forecast(const std::string& path, const std::string& lead_units, double day,
                        const char* axis = "") {
  NetcdfMaker file(path);
  const int l = file.axis("step", {0.5, 1}, lead_units, "forecast_period");
  if (*axis != '\0') file.text(file.variable_id("step"), "axis", axis);
  const auto [z, y, x] = space_of(file);
  const int reference = file.variable("start", NC_DOUBLE, {}, {day});
  file.text(reference, "units", "days since 2000-02-28");
  file.text(reference, "calendar", "noleap");
  file.text(reference, "standard_name", "forecast_reference_time");
  file.variable("t", NC_FLOAT, {l, z, y, x}, tagged({2, 2, 3, 4}));
}

TEST(SelectedEntries, LeadTimesFollowTheOnlyReferenceTime) {
  const Folder folder;
  write_one_forecast(folder / "f_1.nc", "days", 0.5);
  write_one_forecast(folder / "f_2.nc", "days", 1.5);
  const auto source = opened(folder / "f_1.nc");
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(source->info().steps[0].text, "2000-03-01T00:00:00Z") << "no leap day";
  EXPECT_EQ(source->info().steps[1].value, 1.5);
  EXPECT_TRUE(source->info().left_out.empty());
  const auto series = opened(folder / "f_*.nc");
  ASSERT_NE(series, nullptr);
  ASSERT_EQ(series->info().steps.size(), 4U);
  EXPECT_EQ(series->info().steps[3].text, "2000-03-02T12:00:00Z");
  EXPECT_EQ(last_of(volume_of(*series, "t", 3)), 1123);
}

TEST(SelectedEntries, TwoReferenceTimesAreNoDates) {
  for (const double second : {31.0, 32.0}) {
    const Folder folder;
    {
      NetcdfMaker file(folder / "f.nc");
      for (const bool is_second : {false, true}) {
        const int v = file.variable(is_second ? "analysis" : "start", NC_DOUBLE, {},
                                    {is_second ? second * 24 : 31});
        file.text(v, "units", is_second ? "hours since 2000-01-01" : "days since 2000-01-01");
        file.text(v, "standard_name", "forecast_reference_time");
      }
      const int l = file.axis("lead", {6, 12}, "hours", "forecast_period");
      const auto [z, y, x] = space_of(file);
      file.variable("t", NC_FLOAT, {l, z, y, x}, tagged({2, 2, 3, 4}));
    }
    const auto source = opened(folder / "f.nc");
    ASSERT_NE(source, nullptr);
    ASSERT_EQ(source->info().steps.size(), 2U);
    EXPECT_EQ(source->info().steps[1].text, second == 31 ? "2000-02-01T12:00:00Z" : "12");
    EXPECT_EQ(has_note(source->info(),
                       "there are two reference times, 'start' (2000-02-01T00:00:00Z) and "
                       "'analysis' (2000-02-02T00:00:00Z)"),
              second == 32);
    EXPECT_EQ(last_of(volume_of(*source, "t", 1)), 1123);
  }
}

TEST(SelectedEntries, AMissingSecondReferenceTimeIsNoted) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "f.nc");
    for (const char* name : {"start", "analysis"}) {
      const bool is_missing = std::string_view(name) == "analysis";
      const int v = file.variable(name, NC_DOUBLE, {}, {is_missing ? -999.0 : 24});
      file.number(v, "missing_value", NC_DOUBLE, {-999});
      file.text(v, "units", "hours since 2000-01-01");
      file.text(v, "standard_name", "forecast_reference_time");
    }
    const int l = file.axis("lead", {6, 12}, "hours", "forecast_period");
    const auto [z, y, x] = space_of(file);
    file.variable("t", NC_FLOAT, {l, z, y, x}, tagged({2, 2, 3, 4}));
  }
  const auto source = opened(folder / "f.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().steps.at(1).text, "12");
  EXPECT_TRUE(has_note(source->info(),
                       "lead times are not shown as dates: the reference time 'analysis' is "
                       "missing or no date"));
}

TEST(SelectedEntries, LeadTimesOnADeclaredTimeAxisFollowItToo) {
  const Folder folder;
  write_one_forecast(folder / "f.nc", "hours", 0.5, "T");
  const auto source = opened(folder / "f.nc");
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(source->info().steps[1].text, "2000-02-28T13:00:00Z");
  EXPECT_EQ(last_of(volume_of(*source, "t", 1)), 1123);
}

// One lead time, as a dimension of length 1 or without a dimension.
void write_one_lead(const std::string& path, double hours, bool with_dimension) {
  NetcdfMaker file(path);
  const int reference = file.variable("start", NC_DOUBLE, {}, {31});
  file.text(reference, "units", "days since 2000-01-01");
  file.text(reference, "standard_name", "forecast_reference_time");
  std::vector<int> dims;
  if (with_dimension) {
    dims.push_back(file.axis("lead", {hours}, "hours", "forecast_period"));
  } else {
    const int lead = file.variable("lead", NC_DOUBLE, {}, {hours});
    file.text(lead, "units", "hours");
    file.text(lead, "standard_name", "forecast_period");
  }
  const auto [z, y, x] = space_of(file);
  dims.insert(dims.end(), {z, y, x});
  file.variable("t", NC_FLOAT, dims, std::vector<double>(24, hours));
}

TEST(SelectedEntries, FilesOfOneLeadTimeEachAreASeries) {
  for (const bool with_dimension : {true, false}) {
    const Folder folder;
    write_one_lead(folder / "f_a.nc", 12, with_dimension);
    write_one_lead(folder / "f_b.nc", 6, with_dimension);
    const auto one = opened(folder / "f_a.nc");
    ASSERT_NE(one, nullptr);
    ASSERT_EQ(one->info().steps.size(), 1U);
    EXPECT_EQ(one->info().steps[0].text, "2000-02-01T12:00:00Z") << with_dimension;
    EXPECT_TRUE(one->info().left_out.empty()) << with_dimension;
    EXPECT_TRUE(has_note(one->info(), "'lead' after the reference time 2000-02-01T00:00:00Z"));
    const auto series = opened(folder / "f_*.nc");
    ASSERT_NE(series, nullptr);
    ASSERT_EQ(series->info().steps.size(), 2U);
    EXPECT_EQ(series->info().steps[0].text, "2000-02-01T06:00:00Z") << "by time, not by name";
    EXPECT_EQ(last_of(volume_of(*series, "t", 0)), 6);
    EXPECT_EQ(last_of(volume_of(*series, "t", 1)), 12);
  }
}

TEST(SelectedEntries, LeadTimesOfUnknownUnitsAreSteps) {
  const Folder folder;
  write_one_forecast(folder / "f.nc", "fortnights", 0.5);
  const auto source = opened(folder / "f.nc");
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(source->info().steps[0].value, 0.5);
  EXPECT_TRUE(has_note(source->info(), "time steps are the lead times 'step'"));
  EXPECT_FALSE(has_note(source->info(), "after the reference time"));
}

TEST(SelectedEntries, TheCoordinateOfAChoiceIsNotOmitted) {
  const Folder folder;
  write_ensemble(folder / "e.nc");
  for (const char* name : {"e.nc", "e.nc?number=5", "e.nc?number=5&time=6"}) {
    const auto source = opened(folder / name);
    ASSERT_NE(source, nullptr) << name;
    EXPECT_TRUE(source->info().left_out.empty()) << name;
  }
}

TEST(SelectedEntries, ReferenceTimesAreStepsIfALeadTimeIsChosen) {
  const Folder folder;
  write_forecast(folder / "f.nc", false);
  const auto source = opened(folder / "f.nc?leadtime=12");
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 2U);
  EXPECT_EQ(source->info().steps[1].text, "2001-01-02T00:00:00Z");
  EXPECT_EQ(last_of(volume_of(*source, "t", 1)), 12123);
}

TEST(SelectedEntries, AReferenceTimeThatIsMissingIsNoDate) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "f.nc");
    const int r =
        file.axis("reftime", {-999, 24}, "hours since 2001-01-01", "forecast_reference_time");
    file.number(file.variable_id("reftime"), "missing_value", NC_DOUBLE, {-999});
    const int l = file.axis("leadtime", {0, 6}, "hours", "forecast_period");
    const auto [z, y, x] = space_of(file);
    file.variable("t", NC_FLOAT, {r, l, z, y, x}, tagged({2, 2, 2, 3, 4}));
  }
  const auto source = opened(folder / "f.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_THAT(source->info().choices.at(0).values, ElementsAre("nan", "2001-01-02T00:00:00Z"));
  EXPECT_EQ(last_of(volume_of(*source, "t", 1)), 1123);
}

}  // namespace
}  // namespace windsplat::data::test::entries
