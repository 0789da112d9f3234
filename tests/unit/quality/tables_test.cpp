// Tables of styles shared by many: what is kept, for how many, and from several threads at once.
#include "server/quality/tables.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

namespace windsplat::quality {
namespace {

Style style(const std::string& key) { return {key, "data", Kind{}}; }

const Sight sight{1, {0, 1, 0}, 640, 480};

double prior_of(std::size_t setting) { return prior(Kind{}, settings[setting], sight).error; }

TEST(Tables, StylesAreApart) {
  Tables tables;
  tables.add(style("a"), 0, sight, {0.5 * prior_of(0), 3.0});
  EXPECT_LT(tables.forecast(style("a"), 0, sight).error, 0.6 * prior_of(0));
  EXPECT_EQ(tables.forecast(style("b"), 0, sight).error, prior_of(0));
  EXPECT_TRUE(tables.forecasts(style("a"), sight)[0].timed);
  EXPECT_FALSE(tables.forecasts(style("b"), sight)[0].timed);
}

TEST(Tables, AStyleWithoutAKeyHasThePriorAndKeepsNothing) {
  Tables tables;
  tables.add(style(""), 0, sight, {0.5 * prior_of(0), 3.0});
  EXPECT_EQ(tables.forecast(style(""), 0, sight).error, prior_of(0));
  EXPECT_FALSE(tables.begin_study(style(""), sight));
  const double before = tables.encoding_error(style(""), 90, true, sight);
  tables.add_encoding(style(""), 90, sight, 10 * before);
  EXPECT_EQ(tables.encoding_error(style(""), 90, true, sight), before);
}

TEST(Tables, TheStyleUsedLeastRecentlyIsForgotten) {
  Tables tables;
  const auto is_known = [&](int n) {
    return tables.forecast(style(std::to_string(n)), 0, sight).error < 0.9 * prior_of(0);
  };
  const int most = Tables::styles_max;
  for (int n = 0; n < most; ++n) {
    tables.add(style(std::to_string(n)), 0, sight, {0.2 * prior_of(0), {}});
  }
  EXPECT_TRUE(is_known(0));  // used again
  tables.add(style("another"), 0, sight, {0.01, {}});
  EXPECT_TRUE(is_known(0));
  EXPECT_TRUE(is_known(2));
  EXPECT_FALSE(is_known(1));
}

TEST(Tables, LookingAtManyStylesForgetsNone) {
  Tables tables;
  tables.add(style("own"), 0, sight, {0.2 * prior_of(0), 3.0});
  for (std::size_t n = 0; n < 2 * Tables::styles_max; ++n) {
    (void)tables.forecast(style(std::to_string(n)), 0, sight);
    (void)tables.forecasts(style(std::to_string(n)), sight);
    (void)tables.encoding_error(style(std::to_string(n)), 90, true, sight);
    tables.end_study(style(std::to_string(n)), false);
  }
  EXPECT_TRUE(tables.forecasts(style("own"), sight)[0].timed);
}

TEST(Tables, AnotherDatasetsStylesOutlastOneThatChanged) {
  Tables tables;
  const Style sea{"waves", "sea", Kind{}};
  tables.add(style("a"), 0, sight, {0.2 * prior_of(0), 3.0});
  tables.add(sea, 0, sight, {0.2 * prior_of(0), 3.0});
  tables.forget("data");
  EXPECT_FALSE(tables.forecast(style("a"), 0, sight).timed);
  EXPECT_TRUE(tables.forecast(sea, 0, sight).timed);
}

TEST(Tables, AStudyIsBegunByOneOfManyWhoAsk) {
  Tables tables;
  std::atomic<int> begun{0};
  {
    std::vector<std::jthread> threads;
    for (int n = 0; n < 8; ++n) {
      threads.emplace_back([&] { begun += tables.begin_study(style("a"), sight) ? 1 : 0; });
    }
  }
  EXPECT_EQ(begun, 1);
  tables.end_study(style("a"), false);
  EXPECT_TRUE(tables.begin_study(style("a"), sight));
  tables.end_study(style("a"), true);
  EXPECT_FALSE(tables.begin_study(style("a"), sight));
}

// The sanitizer of threads looks on.
TEST(Tables, ManyThreadsAtOnce) {
  Tables tables;
  std::atomic<int> wrong{0};
  {
    std::vector<std::jthread> threads;
    for (int n = 0; n < 4; ++n) {
      threads.emplace_back([&, n] {
        for (int i = 0; i < 300; ++i) {
          const Style one = style(std::to_string((7 * n + i) % 100));
          tables.add(one, static_cast<std::size_t>(i) % settings_count, sight, {0.01, 2.0});
          tables.add_encoding(one, 80, sight, 0.01);
          for (const Forecast& told : tables.forecasts(one, sight)) {
            if (!std::isfinite(told.error) || !(told.error > 0)) ++wrong;
          }
          if (!(tables.encoding_error(one, 80, false, sight) > 0)) ++wrong;
        }
      });
    }
  }
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace windsplat::quality
