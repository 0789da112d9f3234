// GRIB messages of one quantity that differ in their statistic or reference time, or lack levels
// and times of others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"

#ifdef WINDSPLAT_GRIB
#include "tests/unit/data/formats/grib_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

using Settings = std::function<void(Maker&)>;

// A field of `value` everywhere at 500 hPa, of 2020-01-01 00:00 unless set otherwise.
std::string constant(const std::string& quantity, double value, const Settings& settings = {},
                     const std::string& sample = "GRIB2") {
  Maker maker(sample);
  maker.set("dataDate", 20200101L);
  maker.set("dataTime", 0L);
  maker.set("typeOfLevel", std::string("isobaricInhPa"));
  maker.set("level", 500L);
  maker.set("shortName", quantity);
  if (settings) settings(maker);
  maker.fill(value);
  return maker.bytes();
}

Settings step(long hour) {
  return [hour](Maker& maker) { maker.set("stepRange", std::to_string(hour)); };
}

Settings over(const std::string& range, const std::string& type) {
  return [=](Maker& maker) {
    maker.set("stepType", type);
    maker.set("stepRange", range);
  };
}

Settings derived(long number) {
  return [number](Maker& maker) {
    maker.set("productDefinitionTemplateNumber", 2L);
    maker.set("derivedForecast", number);
  };
}

Settings at_level(long level, long hour = 0) {
  return [=](Maker& maker) {
    maker.set("level", level);
    maker.set("stepRange", std::to_string(hour));
  };
}

float value_of(Source& source, const std::string& field, std::size_t time = 0) {
  const DatasetInfo& info = source.info();
  const FieldInfo* found = info.find(field);
  EXPECT_NE(found, nullptr) << field;
  if (found == nullptr) return NAN;
  const auto volume = source.read(static_cast<std::size_t>(found - info.fields.data()), time);
  EXPECT_TRUE(volume);
  return volume ? volume->values[0] : NAN;
}

class GribProducts : public GribFiles {};

TEST_F(GribProducts, StatisticsOverTimeAreFieldsOfTheirOwn) {
  for (const char* sample : {"GRIB2", "GRIB1"}) {
    SCOPED_TRACE(sample);
    const auto source =
        open(constant("t", 20, over("0-3", "avg"), sample) + constant("t", 10, step(3), sample) +
             constant("t", 30, over("0-3", "accum"), sample));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(value_of(*source, "t"), 10);
    EXPECT_EQ(value_of(*source, "t_avg"), 20);
    EXPECT_EQ(value_of(*source, "t_accum"), 30);
    ASSERT_NE(source->info().find("t_avg"), nullptr);
    EXPECT_THAT(source->info().find("t_avg")->long_name, HasSubstr("average over time"));
    EXPECT_EQ(source->info().steps.size(), 1U);
  }
}

TEST_F(GribProducts, ASingleStatisticKeepsItsName) {
  const auto source = open(constant("t", 20, over("0-3", "avg")));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(value_of(*source, "t"), 20);
  EXPECT_THAT(source->info().find("t")->long_name, HasSubstr("average over time"));
}

TEST_F(GribProducts, ExtremesMeansSpreadsPercentilesAndProbabilitiesAreApart) {
  const auto percentile = [](Maker& maker) {
    maker.set("productDefinitionTemplateNumber", 6L);
    maker.set("percentileValue", 90L);
  };
  const auto maximum = [](Maker& maker) {
    maker.set("dataDate", 20191231L);
    maker.set("dataTime", 2100L);
    over("0-3", "max")(maker);
  };
  const auto probability = [](long limit) {
    return [limit](Maker& maker) {
      maker.set("productDefinitionTemplateNumber", 5L);
      maker.set("probabilityType", 1L);
      maker.set("scaleFactorOfUpperLimit", 1L);
      maker.set("scaledValueOfUpperLimit", limit);
    };
  };
  const auto source = open(constant("t", 1, derived(0)) + constant("t", 2, derived(4)) +
                           constant("t", 3, percentile) + constant("t", 4, probability(2731)) +
                           constant("t", 5, probability(2831)) + constant("t", 6, maximum));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(value_of(*source, "t_mean"), 1);
  EXPECT_EQ(value_of(*source, "t_spread"), 2);
  EXPECT_EQ(value_of(*source, "t_p90"), 3);
  EXPECT_EQ(value_of(*source, "t_prob"), 4);
  ASSERT_NE(source->info().find("t_prob"), nullptr);
  ASSERT_NE(source->info().find("t_prob_isobaricInhPa"), nullptr);
  EXPECT_THAT(source->info().find("t_prob")->long_name, HasSubstr("above 273.1"));
  EXPECT_THAT(source->info().find("t_prob_isobaricInhPa")->long_name, HasSubstr("above 283.1"));
  EXPECT_EQ(value_of(*source, "t_max"), 6);
}

TEST_F(GribProducts, VectorsAreOfComponentsOfOneStatistic) {
  const auto source = open(constant("u", 1, step(3)) + constant("v", 22, over("0-3", "avg")) +
                           constant("v", 2, step(3)) + constant("u", 11, over("0-3", "avg")) +
                           constant("u", 5, derived(4)) + constant("v", 6, derived(4)));
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  ASSERT_NE(info.find("wind"), nullptr);
  EXPECT_THAT(info.find("wind")->components, ElementsAre("u", "v"));
  ASSERT_NE(info.find("wind_avg"), nullptr);
  EXPECT_THAT(info.find("wind_avg")->components, ElementsAre("u_avg", "v_avg"));
  const auto vectors = std::count_if(info.fields.begin(), info.fields.end(),
                                     [](const auto& one) { return one.kind == FieldKind::vector; });
  EXPECT_EQ(vectors, 2);
}

Settings run(long date, long time, long hour) {
  return [=](Maker& maker) {
    maker.set("dataDate", date);
    maker.set("dataTime", time);
    maker.set("stepRange", std::to_string(hour));
  };
}

TEST_F(GribProducts, OverlappingForecastsAreChosenByReferenceTime) {
  std::string bytes;
  for (const long hour : {0, 12, 24}) bytes += constant("t", 100.0 + hour, run(20200101, 0, hour));
  for (const long hour : {0, 12, 24}) bytes += constant("t", 200.0 + hour, run(20200102, 0, hour));
  const auto first = open(bytes);
  ASSERT_NE(first, nullptr);
  ASSERT_EQ(first->info().steps.size(), 3U);
  EXPECT_EQ(first->info().steps[2].text, "2020-01-02T00:00:00Z");
  EXPECT_EQ(value_of(*first, "t", 2), 124);
  auto second = open_file((folder_ / "a.grib") + "?forecast_reference_time=2020-01-02T00:00:00Z");
  ASSERT_TRUE(second) << second.error().message;
  ASSERT_EQ((*second)->info().steps.size(), 3U);
  EXPECT_EQ((*second)->info().steps[0].text, "2020-01-02T00:00:00Z");
  EXPECT_EQ(value_of(**second, "t", 0), 200);
}

TEST_F(GribProducts, SuccessiveAnalysesAreOneSeries) {
  const auto source =
      open(constant("t", 1, run(20200101, 0, 0)) + constant("t", 2, run(20200101, 1200, 0)) +
           constant("t", 3, run(20200101, 1200, 6)));
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().steps.size(), 3U);
  EXPECT_EQ(source->info().steps[2].text, "2020-01-01T18:00:00Z");
  EXPECT_EQ(value_of(*source, "t", 2), 3);
  EXPECT_TRUE(source->info().choices.empty());
}

Settings above_ground(long height) {
  return [height](Maker& maker) {
    maker.set("typeOfLevel", std::string("heightAboveGround"));
    maker.set("level", height);
  };
}

// Named 10u, 10v and so on; at 50 m u and v.
TEST_F(GribProducts, WindsOfThreeOrMoreHeightsAreOneQuantity) {
  std::string bytes;
  for (const long height : {100, 10, 50, 200}) {
    const auto value = static_cast<double>(height);
    bytes += constant("u", value, above_ground(height)) + constant("v", 1, above_ground(height));
  }
  const auto source = open(bytes);
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  EXPECT_THAT(info.grid.axes[2].coordinates, ElementsAre(10, 50, 100, 200));
  ASSERT_NE(info.find("wind"), nullptr);
  EXPECT_THAT(info.find("wind")->components, ElementsAre("u", "v"));
  const auto volume =
      source->read(static_cast<std::size_t>(info.find("u") - info.fields.data()), 0);
  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->values[0], 10);
  EXPECT_EQ(volume->values[12], 50);
  EXPECT_EQ(volume->values[24], 100);
  EXPECT_EQ(volume->values[36], 200);
}

TEST_F(GribProducts, WindsOfTwoHeightsAreTwoVectors) {
  const auto source =
      open(constant("u", 10, above_ground(10)) + constant("v", 100, above_ground(100)) +
           constant("v", 10, above_ground(10)) + constant("u", 100, above_ground(100)) +
           constant("2t", 280, above_ground(2)));
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  ASSERT_NE(info.find("wind_10m"), nullptr);
  EXPECT_THAT(info.find("wind_10m")->components, ElementsAre("10u", "10v"));
  ASSERT_NE(info.find("wind_100m"), nullptr);
  EXPECT_THAT(info.find("wind_100m")->components, ElementsAre("100u", "100v"));
  EXPECT_NE(info.find("2t"), nullptr);
}

TEST_F(GribProducts, AbsentLevelsAndTimesAreMasked) {
  std::string bytes;
  for (const long hour : {0, 6}) {
    for (const long level : {1000, 850, 500}) {
      bytes += constant("u", 1, at_level(level, hour)) + constant("v", 2, at_level(level, hour));
      if (level != 850) bytes += constant("w", 3, at_level(level, hour));
      if (hour == 6) bytes += constant("q", 4, at_level(level, hour));
    }
  }
  const auto source = open(bytes);
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  ASSERT_NE(info.find("wind"), nullptr);
  EXPECT_THAT(info.find("wind")->components, ElementsAre("u", "v", "w"));
  EXPECT_THAT(info.notes, AllOf(Contains(HasSubstr("'w' has 2 of 3 levels")),
                                Contains(HasSubstr("'q' has 1 of 2 times"))));
  const std::size_t plane = 4 * 3;
  const auto volume =
      source->read(static_cast<std::size_t>(info.find("w") - info.fields.data()), 0);
  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->values[0], 3);
  EXPECT_TRUE(std::isnan(volume->values[plane]));
  EXPECT_EQ(volume->values[2 * plane], 3);
  EXPECT_TRUE(std::isnan(value_of(*source, "q", 0)));
  EXPECT_EQ(value_of(*source, "q", 1), 4);
}

}  // namespace
}  // namespace windsplat::data::test

#endif
