// Rules by which extreme cases are judged: pictures that are wrong on purpose are found wrong.
#include "server/study/extremes/extremes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>

#include "server/study/extremes/cases.hpp"
#include "server/study/report/extremes_text.hpp"

namespace windsplat::study {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

// Two pixels of a quarter and a half, and the same as their truth.
struct Sample {
  std::vector<float> rgba{0.25F, 0.25F, 0.25F, 0.25F, 0.5F, 0.5F, 0.5F, 0.5F};
  std::vector<std::size_t> pixels{0, 1};
  std::vector<double> truth{rgba.begin(), rgba.end()};
  std::optional<double> reported;
  [[nodiscard]] Verdict verdict() const { return judge({rgba, pixels, truth, reported}); }
};

TEST(Judge, PictureThatEqualsItsTruthIsGood) {
  Sample sample;
  sample.reported = 0;
  const Verdict verdict = sample.verdict();
  EXPECT_TRUE(verdict.good());
  EXPECT_EQ(verdict.rmse, 0);
  EXPECT_EQ(verdict.max, 0);
}

TEST(Judge, ErrorIsTheRmsOverAllChannels) {
  Sample sample;
  sample.truth[2] += 0.1;
  sample.truth[7] -= 0.3;
  const Verdict verdict = sample.verdict();
  EXPECT_NEAR(verdict.rmse, std::sqrt((0.01 + 0.09) / 8), 1e-9);
  EXPECT_NEAR(verdict.max, 0.3, 1e-9);
}

TEST(Judge, PixelsThatAreNotFiniteAreFaults) {
  for (const float value : {nan, std::numeric_limits<float>::infinity()}) {
    Sample sample;
    sample.rgba[5] = value;
    const Verdict verdict = sample.verdict();
    EXPECT_FALSE(verdict.finite);
    EXPECT_FALSE(verdict.good());
    EXPECT_EQ(verdict.rmse, std::numeric_limits<double>::infinity());
    sample.truth.clear();
    EXPECT_FALSE(sample.verdict().finite);
  }
}

TEST(Judge, ChannelsOutsideTheUnitIntervalAreFaults) {
  for (const float value : {1.001F, -0.001F, 2e30F}) {
    Sample sample;
    sample.rgba[3] = value;
    EXPECT_FALSE(sample.verdict().bounded) << value;
    EXPECT_FALSE(sample.verdict().good()) << value;
  }
  Sample rounded;
  rounded.rgba[3] = 1.000001F;
  EXPECT_TRUE(rounded.verdict().bounded);
}

TEST(Judge, ReportedErrorBelowAQuarterOfTheTrueOneIsDishonest) {
  Sample sample;
  for (double& value : sample.truth) value += 0.01;
  sample.reported = 0.0024;
  EXPECT_FALSE(sample.verdict().honest);
  EXPECT_FALSE(sample.verdict().good());
  sample.reported = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(sample.verdict().honest);
  sample.reported = 0.0026;
  EXPECT_TRUE(sample.verdict().honest);
  sample.reported.reset();
  EXPECT_TRUE(sample.verdict().honest);
}

TEST(Judge, ErrorsThatNobodySeesNeedNotBeReported) {
  Sample sample;
  for (double& value : sample.truth) value += 0.9e-4;
  sample.reported = 0;
  EXPECT_TRUE(sample.verdict().honest);
}

TEST(Judge, OpacityThatDecreasesIsNotMonotone) {
  const std::vector<float> before{0, 0, 0, 0.5F, 0, 0, 0, 0.25F};
  std::vector<float> after{0, 0, 0, 0.5F, 0, 0, 0, 0.3F};
  EXPECT_TRUE(is_monotone(before, after, 1e-4));
  EXPECT_FALSE(is_monotone(after, before, 1e-4));
  EXPECT_TRUE(is_monotone(after, before, 0.1));
  after[3] = nan;
  EXPECT_FALSE(is_monotone(before, after, 1e-4));
  CaseResult result;
  result.verdict.monotone = false;
  EXPECT_TRUE(result.failed());
}

// A case by design beyond the limit of opacities.
CaseResult beyond_opacity(const Result<void>& drawn) {
  CaseResult result;
  judge_refusal("/vector/opacity", drawn, result);
  return result;
}

TEST(Judge, OnlyTheRefusalThatADesignStatesIsOne) {
  const Result<void> stated =
      make_error_at(ErrorKind::invalid, "/vector/opacity", "must be at most 1");
  EXPECT_TRUE(beyond_opacity(stated).refused);
  EXPECT_FALSE(beyond_opacity(stated).failed());
  const std::array<Result<void>, 3> others{
      make_error_at(ErrorKind::invalid, "/vector/stride", "must be at least 1"),
      make_error_at(ErrorKind::internal, "/vector/opacity", "is out of order"), Result<void>()};
  for (const Result<void>& other : others) {
    const CaseResult result = beyond_opacity(other);
    EXPECT_FALSE(result.refused) << result.message;
    EXPECT_TRUE(result.failed()) << result.message;
    EXPECT_THAT(result.message, HasSubstr("expected: /vector/opacity"));
  }
  CaseResult unexpected;
  judge_refusal("", stated, unexpected);
  EXPECT_FALSE(unexpected.refused);
  EXPECT_TRUE(unexpected.failed());
  CaseResult drawn;
  judge_refusal("", {}, drawn);
  EXPECT_FALSE(drawn.failed());
}

CaseResult result_at(double value, double rmse, const std::string& projection = "perspective") {
  CaseResult result;
  result.group = "depth";
  result.method = "slab";
  result.projection = projection;
  result.value = value;
  result.label = std::to_string(static_cast<int>(value));
  result.verdict.rmse = rmse;
  return result;
}

CaseResult refused_at(double value) {
  CaseResult result = result_at(value, std::numeric_limits<double>::quiet_NaN());
  result.refused = true;
  result.message = "is too large";
  return result;
}

TEST(Trust, RangesAreThoseOfTheWorstCaseOfEachValue) {
  std::vector<CaseResult> cases{result_at(1, 1e-4), result_at(2, 5e-4), result_at(3, 5e-3),
                                result_at(4, 2e-4), refused_at(5)};
  cases.push_back(result_at(2, 2e-2, "orthographic"));
  const auto trust = trust_of(cases);
  ASSERT_EQ(trust.size(), 1U);
  EXPECT_EQ(trust[0].cases, 6U);
  EXPECT_EQ(trust[0].refused, 1U);
  EXPECT_EQ(trust[0].failed, 0U);
  EXPECT_EQ(trust[0].worst, 2e-2);
  EXPECT_EQ(trust[0].worst_at, "2");
  EXPECT_THAT(trust[0].within, ElementsAre("1, 4", "1, 3 to 4"));
}

TEST(Trust, FailedCasesAreNotTrusted) {
  std::vector<CaseResult> cases{result_at(1, 1e-5), result_at(2, 1e-5), result_at(3, 1e-5)};
  cases[0].verdict.bounded = false;
  EXPECT_THAT(trust_of(cases)[0].within, ElementsAre("2 to 3", "2 to 3"));
  for (CaseResult& one : cases) one.verdict.finite = false;
  EXPECT_THAT(trust_of(cases)[0].within, ElementsAre("none", "none"));
}

TEST(Trust, NamedValuesFormNoRanges) {
  std::vector<CaseResult> cases{result_at(1, 1e-5), result_at(2, 1e-5), result_at(3, 1)};
  for (CaseResult& one : cases) one.value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(trust_of(cases)[0].within, ElementsAre("all but 3", "all but 3"));
  cases[0].verdict.finite = false;
  EXPECT_THAT(trust_of(cases)[0].within, ElementsAre("2", "2"));
  cases[0].verdict.finite = true;
  cases.pop_back();
  EXPECT_THAT(trust_of(cases)[0].within, ElementsAre("all", "all"));
}

TEST(Trust, ReportedErrorsAreComparedWhereTheErrorIsVisible) {
  std::vector<CaseResult> cases{result_at(1, 1e-5), result_at(2, 1e-2), result_at(3, 2e-2)};
  for (CaseResult& one : cases) {
    one.measured = 6e-3;
    one.estimate = 1e-2;
    one.bound = 1.5e-2;
  }
  const Trust trust = trust_of(cases)[0];
  EXPECT_NEAR(trust.least_reported, 0.3, 1e-12);
  EXPECT_EQ(trust.measured, 3U);
  EXPECT_EQ(trust.estimated, 3U);
  EXPECT_EQ(trust.within_bound, 2U);
}

TEST(ExtremesText, NamesFaultsAndReasonsOfRefusals) {
  Extremes extremes;
  extremes.cases = {result_at(1, 1e-5), result_at(2, 1e-2), refused_at(3), result_at(4, 0)};
  extremes.cases[1].verdict.honest = false;
  extremes.cases[1].measured = 1e-3;
  extremes.cases[3].message = "out of order, \"twice\"";
  extremes.trust = trust_of(extremes.cases);
  EXPECT_EQ(extremes.failed(), 2U);
  const std::string text = extremes_text(extremes);
  EXPECT_THAT(text, HasSubstr("failed: depth 2, slab, perspective: measured error 1.0e-03, true "
                              "error 1.0e-02\n"));
  EXPECT_THAT(text, HasSubstr("failed: depth 4, slab, perspective: out of order"));
  EXPECT_THAT(text, HasSubstr("refused: depth 3: is too large\n"));
  const std::string csv = extremes_csv(extremes);
  EXPECT_THAT(csv, HasSubstr("\"out of order, \"\"twice\"\"\"\n"));
  // Every line has as many columns as the first; only the last one contains a comma itself.
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  const auto columns = std::count(line.begin(), line.end(), ',');
  for (std::size_t n = 0; std::getline(lines, line); ++n) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), columns + (n == 3 ? 1 : 0)) << line;
  }
}

TEST(Battery, GroupsHaveDistinctNamesAndLabels) {
  std::set<std::string> names;
  for (const Group& group : groups()) {
    EXPECT_TRUE(names.insert(group.name).second) << group.name;
    std::set<std::string> labels;
    for (const Case& one : group.cases(protocol::Projection::perspective)) {
      EXPECT_TRUE(labels.insert(one.label).second) << group.name << ' ' << one.label;
    }
    EXPECT_GT(labels.size(), 5U) << group.name;
  }
}

TEST(Battery, OpacitiesOfLinesAreMonotoneAndBeyondTheLimitRefused) {
  ThreadPool pool(2);
  const auto extremes = run_extremes({"opacity"}, pool, CancelToken(), {});
  ASSERT_TRUE(extremes);
  EXPECT_EQ(extremes->failed(), 0U);
  std::size_t refused = 0;
  for (const CaseResult& one : extremes->cases) {
    EXPECT_EQ(one.refused, one.value > 1) << one.label;
    refused += one.refused ? 1 : 0;
    if (one.refused) continue;
    EXPECT_TRUE(one.verdict.monotone.value());
    // Slabs and the reference composite lines at their depths.
    if (one.method == "kernel") continue;
    EXPECT_LT(one.verdict.rmse, 1e-2) << one.label << one.method;
  }
  EXPECT_EQ(refused, 6U);  // three methods, two projections
}

TEST(Battery, CancellationEndsIt) {
  ThreadPool pool(1);
  const CancelToken cancel;
  cancel.cancel();
  EXPECT_EQ(run_extremes({}, pool, cancel, {}).error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace windsplat::study
