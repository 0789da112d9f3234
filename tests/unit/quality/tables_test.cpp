// Calibration tables shared by sessions: retention, capacity and concurrent access.
#include "server/quality/tables.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

namespace windsplat::quality {
namespace {

SceneSignature signature(const std::string& key) { return {key, "data", Kind{}}; }

const Viewpoint viewpoint{1, {0, 1, 0}, 640, 480};

double prior_of(std::size_t setting) { return prior(Kind{}, settings[setting], viewpoint).error; }

TEST(Tables, ScenesAreIndependent) {
  Tables tables;
  tables.add(signature("a"), 0, viewpoint, {0.5 * prior_of(0), 3.0});
  EXPECT_LT(tables.forecast(signature("a"), settings[0], viewpoint).error, 0.6 * prior_of(0));
  EXPECT_EQ(tables.forecast(signature("b"), settings[0], viewpoint).error, prior_of(0));
  EXPECT_TRUE(tables.forecasts(signature("a"), viewpoint)[0].timed);
  EXPECT_FALSE(tables.forecasts(signature("b"), viewpoint)[0].timed);
}

TEST(Tables, SceneWithoutAKeyHasThePriorAndKeepsNothing) {
  Tables tables;
  tables.add(signature(""), 0, viewpoint, {0.5 * prior_of(0), 3.0});
  EXPECT_EQ(tables.forecast(signature(""), settings[0], viewpoint).error, prior_of(0));
  EXPECT_FALSE(tables.begin_study(signature(""), viewpoint));
  const double before = tables.encoding_error(signature(""), 90, true, viewpoint);
  tables.add_encoding(signature(""), 90, viewpoint, 10 * before);
  EXPECT_EQ(tables.encoding_error(signature(""), 90, true, viewpoint), before);
}

TEST(Tables, LeastRecentlyUsedSceneIsForgotten) {
  Tables tables;
  const auto is_known = [&](int n) {
    return tables.forecast(signature(std::to_string(n)), settings[0], viewpoint).error <
           0.9 * prior_of(0);
  };
  const int most = Tables::styles_max;
  for (int n = 0; n < most; ++n) {
    tables.add(signature(std::to_string(n)), 0, viewpoint, {0.2 * prior_of(0), {}});
  }
  EXPECT_TRUE(is_known(0));  // used again
  tables.add(signature("another"), 0, viewpoint, {0.01, {}});
  EXPECT_TRUE(is_known(0));
  EXPECT_TRUE(is_known(2));
  EXPECT_FALSE(is_known(1));
}

TEST(Tables, LookupOfManyScenesForgetsNone) {
  Tables tables;
  tables.add(signature("own"), 0, viewpoint, {0.2 * prior_of(0), 3.0});
  for (std::size_t n = 0; n < 2 * Tables::styles_max; ++n) {
    (void)tables.forecast(signature(std::to_string(n)), settings[0], viewpoint);
    (void)tables.forecasts(signature(std::to_string(n)), viewpoint);
    (void)tables.encoding_error(signature(std::to_string(n)), 90, true, viewpoint);
    tables.end_study(signature(std::to_string(n)), false);
  }
  EXPECT_TRUE(tables.forecasts(signature("own"), viewpoint)[0].timed);
}

TEST(Tables, ChangedDatasetKeepsTheScenesOfOthers) {
  Tables tables;
  const SceneSignature sea{"waves", "sea", Kind{}};
  tables.add(signature("a"), 0, viewpoint, {0.2 * prior_of(0), 3.0});
  tables.add(sea, 0, viewpoint, {0.2 * prior_of(0), 3.0});
  tables.forget("data");
  EXPECT_FALSE(tables.forecast(signature("a"), settings[0], viewpoint).timed);
  EXPECT_TRUE(tables.forecast(sea, settings[0], viewpoint).timed);
}

// What one session has drawn, others need not try.
TEST(Tables, TimesOfFramesAreSharedUntilACalibrationRunMeasuresThem) {
  Tables tables;
  tables.add_frame(signature("a"), 2, viewpoint, 4);
  EXPECT_TRUE(tables.forecasts(signature("a"), viewpoint)[2].timed);
  EXPECT_FALSE(tables.forecasts(signature("a"), viewpoint)[0].timed);
  EXPECT_NEAR(tables.forecasts(signature("a"), viewpoint)[2].ms, 4, 0.2);
  for (int n = 0; n < 40; ++n) tables.add_frame(signature("a"), 2, viewpoint, 8);
  EXPECT_NEAR(tables.forecasts(signature("a"), viewpoint)[2].ms, 8, 0.4);
  EXPECT_FALSE(tables.forecasts(signature("b"), viewpoint)[2].timed);
  tables.add(signature("b"), 2, viewpoint, {0.01, 3});
  for (int n = 0; n < 40; ++n) tables.add_frame(signature("b"), 2, viewpoint, 8);
  EXPECT_NEAR(tables.forecasts(signature("b"), viewpoint)[2].ms, 3, 0.2);
  tables.add_frame(signature(""), 2, viewpoint, 4);
  EXPECT_FALSE(tables.forecasts(signature(""), viewpoint)[2].timed);
}

// Of many sessions that wait for the renderer one tries a setting, and the others learn its time.
TEST(Tables, OneOfAHundredFramesMayBeATry) {
  Tables tables;
  EXPECT_FALSE(tables.begin_try(signature("a")));
  int tries = 0;
  for (int n = 0; n < 500; ++n) {
    tables.add_frame(signature("a"), 2, viewpoint, 4);
    for (int session = 0; session < 3; ++session) tries += tables.begin_try(signature("a")) ? 1 : 0;
  }
  EXPECT_EQ(tries, 5);
}

TEST(Tables, ErrorsBetweenTwoSettingsFollowFromBoth) {
  Tables tables;
  tables.add(signature("a"), 3, viewpoint, {0.02, 4.0});
  tables.add(signature("a"), 4, viewpoint, {0.03, 2.0});
  const Setting between{protocol::MethodName::kernel, 3, 0, 1, 4};
  const Forecasts known = tables.forecasts(signature("a"), viewpoint);
  const Forecast at = tables.forecast(signature("a"), between, viewpoint);
  EXPECT_NEAR(at.error, std::sqrt(known[3].error * known[4].error), 1e-12);
  EXPECT_NEAR(at.ms, std::sqrt(known[3].ms * known[4].ms), 1e-12);
}

TEST(Tables, OneOfManyCallersStartsTheCalibrationRun) {
  Tables tables;
  std::atomic<int> begun{0};
  {
    std::vector<std::jthread> threads;
    for (int n = 0; n < 8; ++n) {
      threads.emplace_back([&] { begun += tables.begin_study(signature("a"), viewpoint) ? 1 : 0; });
    }
  }
  EXPECT_EQ(begun, 1);
  tables.end_study(signature("a"), false);
  EXPECT_TRUE(tables.begin_study(signature("a"), viewpoint));
  tables.end_study(signature("a"), true);
  EXPECT_FALSE(tables.begin_study(signature("a"), viewpoint));
}

// Run under ThreadSanitizer.
TEST(Tables, ManyThreadsConcurrently) {
  Tables tables;
  std::atomic<int> wrong{0};
  {
    std::vector<std::jthread> threads;
    for (int n = 0; n < 4; ++n) {
      threads.emplace_back([&, n] {
        for (int i = 0; i < 300; ++i) {
          const SceneSignature one = signature(std::to_string((7 * n + i) % 100));
          tables.add(one, static_cast<std::size_t>(i) % settings_count, viewpoint, {0.01, 2.0});
          tables.add_encoding(one, 80, viewpoint, 0.01);
          for (const Forecast& told : tables.forecasts(one, viewpoint)) {
            if (!std::isfinite(told.error) || !(told.error > 0)) ++wrong;
          }
          if (!(tables.encoding_error(one, 80, false, viewpoint) > 0)) ++wrong;
        }
      });
    }
  }
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace windsplat::quality
