// Measurements of one scene -> forecasts, compared with closed forms.
#include "server/quality/table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "server/quality/laws.hpp"
#include "server/quality/pick.hpp"

namespace windsplat::quality {
namespace {

using protocol::MethodName;

constexpr std::size_t kernel = 0;
constexpr std::size_t half = 2;  // half the width
constexpr std::size_t merged = 8;
static_assert(settings[merged] == Setting{MethodName::kernel, 0, 1});
const Kind kind{true, true, 1.4, 1};

// A viewpoint at that distance from all others: only the height differs.
Viewpoint sight_at(double steps) {
  Viewpoint viewpoint{std::exp(0.5 * steps), {0, 1, 0}, 640, 480};
  viewpoint.content.emplace();
  viewpoint.identity = std::hash<double>{}(steps) | 1U;
  return viewpoint;
}

// Moved sideways, or of another step.
Viewpoint beside(Viewpoint viewpoint) {
  viewpoint.identity += 2;
  return viewpoint;
}

double prior_of(std::size_t setting, const Viewpoint& viewpoint) {
  return prior(kind, settings[setting], viewpoint).error;
}

TEST(Table, WithoutMeasurementsEqualsThePrior) {
  const Table table(kind);
  const Forecasts told = table.forecasts(sight_at(0));
  for (std::size_t i = 0; i < told.size(); ++i) {
    const Forecast expected = prior(kind, settings[i], sight_at(0));
    EXPECT_EQ(told[i].error, expected.error);
    EXPECT_EQ(told[i].spread, expected.spread);
    EXPECT_EQ(told[i].ms, expected.ms);
    EXPECT_FALSE(told[i].timed);
  }
}

TEST(Table, AtAMeasuredViewpointEqualsTheMeasurement) {
  Table table(kind);
  const double error = 5 * prior_of(half, sight_at(0));
  const double ms = 7 * prior(kind, settings[half], sight_at(0)).ms;
  table.add(half, sight_at(0), {error, ms});
  const Forecast told = table.forecast(half, sight_at(0));
  EXPECT_NEAR(told.error / error, 1, 0.03);
  EXPECT_NEAR(told.ms / ms, 1, 0.03);
  EXPECT_TRUE(told.timed);
  EXPECT_LT(told.spread, 0.1);
}

// Errors of fewer pixels and of merged samples have much in common, and most those of one cause.
TEST(Table, AMeasurementCorrectsOtherSettingsInProportionToWhatTheyShare) {
  Table table(kind);
  const std::size_t smaller = index_of({MethodName::kernel, 3, 0}).value();
  table.add(half, sight_at(0), {3 * prior_of(half, sight_at(0)), {}});
  const auto ratio = [&](std::size_t setting) {
    return table.forecast(setting, sight_at(0)).error / prior_of(setting, sight_at(0));
  };
  EXPECT_GT(ratio(merged), 1.1);
  EXPECT_GT(ratio(smaller), ratio(merged));
  EXPECT_GT(ratio(half), ratio(smaller));
  EXPECT_FALSE(table.forecast(smaller, sight_at(0)).measured);
}

// In units of their spreads, two settings say as much about each other: an uncertain estimate that
// is wrong does not change a certain one by as much.
TEST(Table, SettingsCorrectEachOtherByTheSameShareOfTheirSpreads) {
  const auto response = [](std::size_t measured, std::size_t other) {
    const Forecast before = prior(kind, settings[measured], sight_at(0));
    const Forecast untold = prior(kind, settings[other], sight_at(0));
    Table table(kind);
    table.add(measured, sight_at(0), {before.error * std::exp(before.spread), {}});
    return std::log(table.forecast(other, sight_at(0)).error / untold.error) / untold.spread;
  };
  EXPECT_GT(response(merged, half), 0.1);
  EXPECT_NEAR(response(merged, half) / response(half, merged), 1, 0.05);
}

// A viewpoint of unknown content has that of the nearest measured one.
TEST(Table, UnknownContentIsThatOfTheNearestMeasurement) {
  Table table(kind);
  Viewpoint seen = sight_at(0);
  seen.content = Content{};
  seen.content->lines *= 2;
  seen.content->cell *= 3;
  table.add(half, seen, {prior_of(half, seen), {}});
  Viewpoint nearer = sight_at(-1);
  nearer.content.reset();
  const double told = table.forecast(half, nearer).error;
  nearer.content = scaled(*seen.content, seen.height / nearer.height);
  EXPECT_NEAR(told / prior_of(half, nearer), 1, 1e-9);
}

// A picture is measured before its view is described.
TEST(Table, DescribedLaterEqualsMeasuredWithItsContent) {
  Viewpoint seen = sight_at(0);
  seen.content = Content{};
  seen.content->lines *= 2;
  seen.content->cell *= 3;
  Viewpoint unknown = seen;
  unknown.content.reset();
  Table at_once(kind);
  at_once.add(half, seen, {0.02, {}});
  Table later(kind);
  later.add(half, unknown, {0.02, {}});
  EXPECT_GT(later.forecast(half, unknown).spread, at_once.forecast(half, unknown).spread)
      << "typical content is less certain";
  later.describe(seen);
  for (const double steps : {0.0, 1.0}) {
    Viewpoint other = sight_at(steps);
    other.content.reset();
    for (const std::size_t setting : {half, merged, kernel}) {
      const Forecast expected = at_once.forecast(setting, other);
      const Forecast told = later.forecast(setting, other);
      EXPECT_NEAR(told.error / expected.error, 1, 1e-9) << setting;
      EXPECT_NEAR(told.spread, expected.spread, 1e-9) << setting;
    }
  }
}

// A measurement of unknown content is compared with a guess, which must not pass for known.
TEST(Table, GuessedContentOfAMeasurementStaysAGuess) {
  Table table(kind);
  Viewpoint unknown = sight_at(0);
  unknown.content.reset();
  table.describe(sight_at(2));
  const double before = table.forecast(merged, unknown).spread;
  EXPECT_GT(before, table.forecast(merged, sight_at(0)).spread);
  table.add(kernel, unknown, {0.01, {}});
  const double known = table.forecast(merged, sight_at(0)).spread;
  EXPECT_NEAR(table.forecast(merged, unknown).spread / before, 1, 0.05);
  EXPECT_GT(table.forecast(merged, unknown).spread, 1.02 * known);
}

// A typical content is least certain, and that of another view the less the farther it is; only the
// content of the very same view is certain.
TEST(Table, GuessedContentWidensTheSpread) {
  const auto unknown_at = [](double steps) {
    Viewpoint viewpoint = sight_at(steps);
    viewpoint.content.reset();
    return viewpoint;
  };
  Table table(kind);
  const double typical = table.forecast(half, unknown_at(0)).spread;
  EXPECT_GT(typical, 1.05 * table.forecast(half, sight_at(0)).spread);
  EXPECT_EQ(typical, prior(kind, settings[half], unknown_at(0)).spread);
  table.add(half, sight_at(0), {1e-3, {}});
  EXPECT_NEAR(table.forecast(half, unknown_at(0)).spread, table.forecast(half, sight_at(0)).spread,
              1e-12)
      << "the content of this very view";
  const double moved = table.forecast(half, beside(unknown_at(0))).spread;
  double last = moved - table.forecast(half, beside(sight_at(0))).spread;
  EXPECT_GT(last, 1e-3) << "the content of a view beside it";
  for (const double steps : {0.5, 1.0, 2.0}) {
    const double known = table.forecast(half, sight_at(steps)).spread;
    const double guessed = table.forecast(half, unknown_at(steps)).spread;
    EXPECT_GT(guessed - known, last) << steps;
    last = guessed - known;
  }
}

// Panned cameras and other steps have the same viewpoint but for their identity.
TEST(Table, DescribingAViewLeavesThoseBesideItAsTheyAre) {
  Viewpoint seen = sight_at(0);
  seen.content->cell *= 3;
  Viewpoint other = beside(sight_at(0));
  Table table(kind);
  table.describe(seen);
  table.describe(other);
  ASSERT_TRUE(table.content(seen));
  EXPECT_EQ(table.content(seen)->cell, seen.content->cell);
  ASSERT_TRUE(table.content(other));
  EXPECT_EQ(table.content(other)->cell, other.content->cell);
  EXPECT_FALSE(table.content(beside(other))) << "not described";
  seen.content.reset();
  EXPECT_EQ(table.forecast(half, seen).spread, prior(kind, settings[half], sight_at(0)).spread);
  for (std::size_t n = 0; n < Table::descriptions_max; ++n) {
    table.describe(sight_at(static_cast<double>(n + 1)));
  }
  EXPECT_FALSE(table.content(seen)) << "no more are kept";
}

TEST(Table, TheErrorOfDetailIsThatOfThisViewOrTheNearestWithOne) {
  Table table(kind);
  EXPECT_FALSE(table.detail(sight_at(0)));
  for (const double steps : {0.2, 0.4}) {
    Viewpoint seen = sight_at(steps);
    seen.content->detail = DetailError{0.1 * steps, 2, {1, 1, 1}};
    table.describe(seen);
  }
  table.describe(sight_at(0));  // without one
  ASSERT_TRUE(table.detail(sight_at(0)));
  EXPECT_DOUBLE_EQ(table.detail(sight_at(0))->error, 0.02);
  EXPECT_DOUBLE_EQ(table.detail(sight_at(0.4))->error, 0.04);
  EXPECT_FALSE(table.detail(sight_at(9))) << "too far away";
}

// Measured of another view whose content is a guess: what the guess leaves out is not an error of
// the law.
TEST(Table, AMeasurementOfGuessedContentCorrectsKnownContentLess) {
  const double ratio = 3;
  const auto correction = [&](bool known) {
    Table table(kind);
    Viewpoint measured = sight_at(0);
    if (!known) measured.content.reset();
    table.add(half, measured, {ratio * prior_of(half, sight_at(0)), {}});
    return table.forecast(half, beside(sight_at(0))).error / prior_of(half, sight_at(0));
  };
  EXPECT_GT(correction(true), 1.8);
  EXPECT_GT(correction(false), 1.02);
  EXPECT_LT(correction(false), 0.95 * correction(true));
  // At the measured view itself, of the same guess, the measurement holds.
  Table table(kind);
  Viewpoint unknown = sight_at(0);
  unknown.content.reset();
  const double error = ratio * prior(kind, settings[half], unknown).error;
  table.add(half, unknown, {error, {}});
  EXPECT_NEAR(table.forecast(half, unknown).error / error, 1, 0.03);
}

TEST(Table, ErrorMeasurementsNeverReplaceTimes) {
  Table table(kind);
  table.add(half, sight_at(0), {0.02, 50.0});
  for (std::size_t n = 0; n < 2 * Table::measurements_max; ++n) {
    table.add(half, sight_at(0.1 * static_cast<double>(n)), {0.02, {}});
  }
  EXPECT_NEAR(table.forecast(half, sight_at(0)).ms, 50, 5);
  EXPECT_TRUE(table.forecast(half, sight_at(0)).timed);
}

TEST(Table, NonFiniteMeasurementsAreIgnored) {
  Table table(kind);
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    table.add(half, sight_at(0), {bad, {}});
    table.add(half, sight_at(0), {{}, bad});
  }
  EXPECT_EQ(table.forecast(half, sight_at(0)).error, prior_of(half, sight_at(0)));
  EXPECT_FALSE(table.forecast(half, sight_at(0)).timed);
}

// One measurement: E = c / (c(0) + noise^2) of its logarithm relative to the prior, where c is the
// correlated variance at that distance.
TEST(Table, MeasurementsAreWeightedByTheirShareOfTheVariance) {
  const Scatter scatter = expected_error(kind, settings[half], sight_at(0)).scatter;
  const double signature = scatter.signature * scatter.signature;
  const double near = scatter.viewpoint * scatter.viewpoint;
  const double own = signature + near + scatter.noise * scatter.noise;
  Table table(kind);
  table.add(half, sight_at(0), {3 * prior_of(half, sight_at(0)), {}});
  for (const double steps : {0.0, 0.3, 1.0, 2.0, 5.0, 30.0}) {
    const Viewpoint viewpoint = sight_at(steps);
    const double shared = signature + near * std::exp(-distance(viewpoint, sight_at(0)));
    const Forecast told = table.forecast(half, viewpoint);
    EXPECT_NEAR(std::log(told.error / prior_of(half, viewpoint)), shared / own * std::log(3.0),
                1e-9);
    EXPECT_NEAR(told.spread, std::sqrt(own - shared * shared / own), 1e-9);
  }
}

TEST(Table, UncertaintyGrowsWithDistanceAndShrinksWithMeasurements) {
  Table table(kind);
  table.add(half, sight_at(0), {0.01, {}});
  double last = 0;
  for (const double steps : {0.0, 0.2, 0.5, 1.0, 2.0, 4.0}) {
    const double spread = table.forecast(half, sight_at(steps)).spread;
    EXPECT_GT(spread, last) << steps;
    EXPECT_LT(spread, prior(kind, settings[half], sight_at(steps)).spread);
    last = spread;
  }
  table.add(half, sight_at(-4), {0.01, {}});
  table.add(half, sight_at(8), {0.01, {}});
  EXPECT_LT(table.forecast(half, sight_at(4)).spread, last);
}

// Far from the measurements the scene still has its own bias.
TEST(Table, FarAwayEstimatesKeepTheBiasOfTheScene) {
  Table table(kind);
  const double factor = 4;
  table.add(half, sight_at(0), {factor * prior_of(half, sight_at(0)), {}});
  const double far = table.forecast(half, sight_at(60)).error / prior_of(half, sight_at(60));
  EXPECT_GT(far, 1.2);
  EXPECT_LT(far, factor);
}

TEST(Table, TwoMeasurementsAtOneViewpointGiveTheirGeometricMean) {
  Table table(kind);
  const double base = prior_of(half, sight_at(0));
  table.add(half, sight_at(0), {base * 2, {}});
  table.add(half, sight_at(0), {base * 8, {}});
  EXPECT_NEAR(table.forecast(half, sight_at(0)).error / (4 * base), 1, 0.03);
}

TEST(Table, NearerMeasurementHasMoreWeight) {
  Table table(kind);
  const auto ratio = [&](double steps) {
    return table.forecast(half, sight_at(steps)).error / prior_of(half, sight_at(steps));
  };
  table.add(half, sight_at(0), {2 * prior_of(half, sight_at(0)), {}});
  table.add(half, sight_at(3), {0.5 * prior_of(half, sight_at(3)), {}});
  EXPECT_GT(ratio(0.5), 1.1);
  EXPECT_LT(ratio(2.5), 0.9);
  EXPECT_NEAR(ratio(1.5), 1, 1e-9);
}

TEST(Table, KeepsTheNewestMeasurementsOfASetting) {
  Table table(kind);
  const double base = prior_of(half, sight_at(0));
  for (int i = 0; i < 40; ++i) table.add(half, sight_at(0), {base * 10, {}});
  const auto most = static_cast<int>(Table::measurements_max);
  for (int i = 0; i < most; ++i) table.add(half, sight_at(0), {base * 0.1, {}});
  EXPECT_NEAR(table.forecast(half, sight_at(0)).error / (0.1 * base), 1, 0.03);
}

TEST(Table, ManyMeasurementsAtOneViewpointStayStable) {
  Table table(kind);
  for (int i = 0; i < 100; ++i) table.add(kernel, sight_at(0), {0.01, 5.0});
  const Forecast told = table.forecast(kernel, sight_at(0.7));
  EXPECT_TRUE(std::isfinite(told.error) && told.error > 0);
  EXPECT_TRUE(std::isfinite(told.spread) && told.spread > 0);
  EXPECT_GT(error_bound(told), told.error);
}

// A zero error is a rounding error: logarithms stay finite.
TEST(Table, ZeroErrorIsTheSmallestStoredError) {
  Table table(kind);
  table.add(half, sight_at(0), {0.0, 0.0});
  const Forecast told = table.forecast(half, sight_at(0));
  EXPECT_GE(told.error, error_least);
  EXPECT_LT(told.error, 1.5 * error_least);
  EXPECT_GT(told.ms, 0);
}

// Unmeasured times follow the measured ones.
TEST(Table, SpeedOfTheMachineAppliesToEverySetting) {
  Table table(kind);
  for (const std::size_t i : {kernel, half}) {
    table.add(i, sight_at(0), {{}, 10 * prior(kind, settings[i], sight_at(0)).ms});
  }
  const Forecasts told = table.forecasts(sight_at(0));
  const std::size_t other = index_of({MethodName::slab, 0, 0}).value();
  EXPECT_FALSE(told[other].timed);
  EXPECT_NEAR(told[other].ms / prior(kind, settings[other], sight_at(0)).ms, 10, 0.5);
}

// Where cells are smaller than the resolution, data are merged and follow another law: measurements
// of one regime correct the other less.
TEST(Table, MergedDataFollowAnotherLawThanFullDetail) {
  Table table(kind);
  Viewpoint near = sight_at(0);
  near.detail = 1.1;
  Viewpoint far = near;
  far.detail = 0.9;
  const std::size_t slab = own_setting({});
  table.add(slab, near, {3 * prior_of(slab, near), {}});
  EXPECT_NEAR(table.forecast(slab, near).error / prior_of(slab, near), 3, 0.2);
  EXPECT_LT(table.forecast(slab, far).error, 2.5 * prior_of(slab, far));
  EXPECT_GT(prior_of(slab, far), 5 * prior_of(slab, near));
}

TEST(Study, StartsOnceAndIsNeededWhereNothingIsKnown) {
  Table table(kind);
  EXPECT_TRUE(table.wants_study(sight_at(0)));
  table.begin_study(sight_at(0));
  EXPECT_FALSE(table.wants_study(sight_at(0)));
  EXPECT_FALSE(table.wants_study(sight_at(10))) << "one at a time";
  table.end_study(true);
  EXPECT_FALSE(table.wants_study(sight_at(0)));
  EXPECT_FALSE(table.wants_study(sight_at(0.1)));
  EXPECT_TRUE(table.wants_study(sight_at(2)));
}

TEST(Study, InterruptedRunIsNeededAgain) {
  Table table(kind);
  table.begin_study(sight_at(0));
  table.end_study(false);
  EXPECT_TRUE(table.wants_study(sight_at(0)));
}

TEST(Study, OldestRunsAreForgotten) {
  Table table(kind);
  for (std::size_t i = 0; i <= Table::studies_max; ++i) {
    table.begin_study(sight_at(2.0 * static_cast<double>(i)));
    table.end_study(true);
  }
  EXPECT_TRUE(table.wants_study(sight_at(0)));
  EXPECT_FALSE(table.wants_study(sight_at(2)));
}

TEST(Encoding, ErrorFallsWithQualityAndGrowsWithHalfChroma) {
  const Table table(kind);
  for (int quality = 11; quality <= 100; ++quality) {
    EXPECT_LT(table.encoding_error(quality, true, sight_at(0)),
              table.encoding_error(quality - 1, true, sight_at(0)));
  }
  EXPECT_GT(table.encoding_error(80, false, sight_at(0)),
            table.encoding_error(80, true, sight_at(0)));
}

TEST(Encoding, FollowsMeasurements) {
  Table table(kind);
  const double before = table.encoding_error(60, true, sight_at(0));
  const double measured = 3 * table.encoding_error(90, true, sight_at(0));
  table.add_encoding(90, sight_at(0), measured);
  EXPECT_NEAR(table.encoding_error(90, true, sight_at(0)) / measured, 1, 1e-9);
  EXPECT_NEAR(table.encoding_error(60, true, sight_at(0)) / before, 3, 1e-9);
  for (int i = 0; i < 20; ++i) table.add_encoding(90, sight_at(0), 2 * measured);
  EXPECT_NEAR(table.encoding_error(90, true, sight_at(0)) / measured, 2, 1e-4)
      << "the newest measurements have the largest weight";
}

TEST(Encoding, CloserViewpointsNeedMoreBytes) {
  Table table(kind);
  table.add_encoding(90, sight_at(0), 0.01);
  EXPECT_GT(table.encoding_error(90, true, sight_at(-1)), 0.01);
  EXPECT_LT(table.encoding_error(90, true, sight_at(1)), 0.01);
}

// Halving chroma adds the same squared error at any quality.
TEST(Encoding, HalfChromaAddsTheSameAtEveryQuality) {
  Table table(kind);
  table.add_encoding(90, sight_at(0), 0.02);
  const auto added = [&](int quality) {
    const double whole = table.encoding_error(quality, true, sight_at(0));
    const double halved = table.encoding_error(quality, false, sight_at(0));
    return std::sqrt(halved * halved - whole * whole);
  };
  for (const int quality : {1, 40, 70, 95}) EXPECT_NEAR(added(quality), added(90), 1e-12);
}

TEST(Encoding, InvalidErrorsAreIgnored) {
  Table table(kind);
  const double before = table.encoding_error(90, true, sight_at(0));
  for (const double wrong : {0.0, -1.0, std::nan(""), double{INFINITY}}) {
    table.add_encoding(90, sight_at(0), wrong);
  }
  EXPECT_EQ(table.encoding_error(90, true, sight_at(0)), before);
}

}  // namespace
}  // namespace windsplat::quality
