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

TEST(CommonSteps, OfSeriesWithASingleFileAreKeptLikewise) {
  const Folder folder;
  for (const int n : {0, 1, 2}) {
    write_field(folder / ("a_" + std::to_string(n) + ".nc"), "a", {6.0 * n});
  }
  write_field(folder / "b.nc", "b", {0, 6, 12});
  write_bytes(folder / "a_1.nc", "CDF");
  for (const char* name : {"{a_*,b}.nc", "{b,a_*}.nc"}) {
    const auto source = opened(folder / name);
    ASSERT_NE(source, nullptr);
    EXPECT_THAT(values_of_steps(source->info()), testing::ElementsAre(0, 12));
    EXPECT_EQ(volume_of(*source, "a", 1).values[0], 12);
    EXPECT_TRUE(has_note(source->info(), "1 step is left out, which other parts do not have"));
    EXPECT_TRUE(has_note(source->info(), "1 file joined along time"));
  }
}

// Steps have numbers only, so that the second of one part could be the third of another.
TEST(CommonSteps, NumberedStepsOfDamagedSeriesAreRefused) {
  const Folder folder;
  const auto write = [&](const std::string& part, int n) {
    NetcdfMaker file(folder / (part + std::to_string(n) + ".nc"));
    const int t = file.dimension("time", NC_UNLIMITED);
    const int y = file.axis("lat", {0, 10}, "degrees_north");
    const int x = file.axis("lon", {0, 10, 20}, "degrees_east");
    file.variable(part, NC_FLOAT, {t, y, x}, std::vector<double>(6, n));
  };
  for (const int n : {0, 1, 2, 3}) {
    write("a", n);
    write("b", n);
  }
  EXPECT_EQ(opened(folder / "{a,b}*.nc")->info().steps.size(), 4U);
  write_bytes(folder / "a1.nc", "CDF");
  write_bytes(folder / "b2.nc", "CDF");
  EXPECT_THAT(refusal(folder / "{a,b}*.nc"),
              testing::AllOf(HasSubstr("its steps are numbered and files are damaged"),
                             HasSubstr("'a1.nc'"), HasSubstr("'b2.nc'")));
  // Files of a grid have no steps that could be confused.
  {
    NetcdfMaker file(folder / "g.nc");
    const int y = file.axis("lat", {0, 10}, "degrees_north");
    const int x = file.axis("lon", {0, 10, 20}, "degrees_east");
    file.variable("g", NC_FLOAT, {y, x}, counting(6));
  }
  EXPECT_EQ(opened(folder / "{a*,g}.nc")->info().steps.size(), 3U);
}

TEST(CommonSteps, ASingleTimeStoredAsADoubleIsExact) {
  const Folder folder;
  const std::string days = "days since 0001-01-01";
  write_field(folder / "a.nc", "a", {738000}, days);
  write_field(folder / "b.nc", "b", {738000.0625}, days);
  EXPECT_THAT(refusal(folder / "{a,b}.nc"), HasSubstr("its times are others"));
  const std::string seconds = "seconds since 1970-01-01";
  write_field(folder / "c.nc", "c", {1.6e9}, seconds);
  write_field(folder / "d.nc", "d", {1.6e9 + 180}, seconds);
  EXPECT_THAT(refusal(folder / "{c,d}.nc"), HasSubstr("its times are others"));
  write_field(folder / "e.nc", "e", {738000, 738001}, days);
  write_field(folder / "f.nc", "f", {738000.08, 738001.08}, days);
  EXPECT_THAT(refusal(folder / "{e,f}.nc"), HasSubstr("its times are others"));
  // Fractions of a day are rounded when they are converted.
  write_field(folder / "g.nc", "g", {11323 + 1 / 24.0 + 1 / 86400.0}, "days since 1970-01-01");
  write_field(folder / "h.nc", "h", {3601}, "seconds since 2001-01-01");
  for (const char* name : {"{g,h}.nc", "{h,g}.nc"}) {
    const auto source = opened(folder / name);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().steps.size(), 1U);
    EXPECT_FALSE(has_note(source->info(), "the rounding of 32-bit floats"));
  }
}

// 738000.05 has the neighbours 738000 and 738000.0625 among floats.
TEST(CommonSteps, TimesStoredInSinglePrecisionAreJoinedWithANote) {
  const Folder folder;
  const std::string days = "days since 0001-01-01";
  for (const int n : {0, 1}) {
    const std::string number = std::to_string(n) + ".nc";
    write_field(folder / ("a" + number), "a", {738000.05 + n}, days);
    write_field(folder / ("b" + number), "b", {738000.05 + n}, days, NC_FLOAT);
  }
  for (const char* name : {"{a0,b0}.nc", "{b0,a0}.nc", "{a,b}*.nc", "{b,a}*.nc"}) {
    const auto source = opened(folder / name);
    ASSERT_NE(source, nullptr) << name;
    EXPECT_TRUE(has_note(source->info(), "within the rounding of 32-bit floats")) << name;
  }
}

TEST(CommonSteps, AnEmptyDimensionBesideTimeIsNoLackOfSteps) {
  const Folder folder;
  for (const int n : {0, 1}) {
    const std::string path = folder / ("a" + std::to_string(n) + ".nc");
    NetcdfMaker file(path);
    const int t = file.dimension("time", 1);
    file.text(file.variable("time", NC_DOUBLE, {t}, {6.0 * n}), "units", "hours since 2001-01-01");
    const int y = file.axis("lat", {0, 10}, "degrees_north");
    const int x = file.axis("lon", {0, 10, 20}, "degrees_east");
    file.variable("a", NC_FLOAT, {t, y, x}, std::vector<double>(6, n));
    const int floats = file.dimension("floats", NC_UNLIMITED);
    const int length = file.dimension("strlen", 8);
    file.variable("float_name", NC_CHAR, {floats, length});
    file.variable("float_place", NC_FLOAT, {floats, length});
  }
  const auto source = opened(folder / "a*.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().steps.size(), 2U);
}

}  // namespace
}  // namespace windsplat::data::test
