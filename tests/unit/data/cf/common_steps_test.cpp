// Lists of series of which some files are damaged, and times that must not be taken for others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::HasSubstr;

// All samples have the value of the first time.
void write_field(const std::string& path, const std::string& name, const std::vector<double>& times,
                 const std::string& units = "hours since 2001-01-01", nc_type type = NC_DOUBLE) {
  NetcdfMaker file(path);
  const int t = file.dimension("time", NC_UNLIMITED);
  file.text(file.variable("time", type, {t}, times), "units", units);
  const int y = file.axis("lat", {0, 10}, "degrees_north");
  const int x = file.axis("lon", {0, 10, 20}, "degrees_east");
  file.variable(name, NC_FLOAT, {t, y, x}, std::vector<double>(6 * times.size(), times.front()));
}

std::vector<double> values_of_steps(const DatasetInfo& info) {
  std::vector<double> out;
  for (const TimeStep& step : info.steps) out.push_back(step.value);
  return out;
}

// Files at 0, 6, 12 and 18 hours; `a` lacks 6 and `b`, in days, lacks 18.
TEST(CommonSteps, StepsOfDamagedFilesAreLeftOutOfEveryPart) {
  const Folder folder;
  for (const int n : {0, 1, 2, 3}) {
    const std::string number = std::to_string(n) + ".nc";
    write_field(folder / ("a_" + number), "a", {6.0 * n});
    write_field(folder / ("b_" + number), "b", {0.25 * n}, "days since 2001-01-01");
  }
  write_bytes(folder / "a_1.nc", "CDF");
  write_bytes(folder / "b_3.nc", "CDF");
  const auto source = opened(folder / "{a,b}_*.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_THAT(values_of_steps(source->info()), testing::ElementsAre(0, 12));
  EXPECT_EQ(volume_of(*source, "a", 1).values[0], 12);
  EXPECT_EQ(volume_of(*source, "b", 1).values[0], 0.5);
  EXPECT_TRUE(has_note(source->info(), "'a_1.nc'"));
  EXPECT_TRUE(has_note(source->info(), "'b_3.nc'"));
  EXPECT_TRUE(has_note(source->info(), "'a_*.nc': 1 step is left out"));
  EXPECT_TRUE(has_note(source->info(), "'b_*.nc': 1 step is left out"));
}

TEST(CommonSteps, OtherDifferencesOfTimesAreStillRefused) {
  const Folder folder;
  for (const int n : {0, 1, 2}) {
    const std::string number = std::to_string(n) + ".nc";
    write_field(folder / ("a_" + number), "a", {6.0 * n});
    write_field(folder / ("b_" + number), "b", {6.0 * n + (n == 2 ? 1 : 0)});
  }
  EXPECT_THAT(refusal(folder / "{a,b}_*.nc"), HasSubstr("its times are others"));
  write_bytes(folder / "b_0.nc", "CDF");
  EXPECT_THAT(refusal(folder / "{a,b}_*.nc"), HasSubstr("its times are others"));
}

// Half an hour is a millionth of the time since 1900.
TEST(CommonSteps, TimesHalfAStepApartAreOthers) {
  const Folder folder;
  const std::string since = "hours since 1900-01-01";
  write_field(folder / "a.nc", "a", {885000, 885001, 885002}, since);
  write_field(folder / "b.nc", "b", {885000.5, 885001.5, 885002.5}, since);
  write_field(folder / "c.nc", "c", {885000, 885001, 885002}, since, NC_FLOAT);
  EXPECT_THAT(refusal(folder / "{a,b}.nc"), HasSubstr("its times are others"));
  EXPECT_EQ(opened(folder / "{a,c}.nc")->info().steps.size(), 3U);
}

}  // namespace
}  // namespace windsplat::data::test
