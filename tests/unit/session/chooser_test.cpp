// The chooser and the times it relies on: measured times correct forecasts; finer settings are
// chosen with hysteresis, coarser ones at once.
#include "server/session/pacing/chooser.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "server/session/pacing/frame_times.hpp"

namespace windsplat::session {
namespace {

using quality::Forecasts;
using quality::settings;

constexpr double no_limit = std::numeric_limits<double>::infinity();
constexpr Micros frame_us = 33'000;
const quality::Viewpoint viewpoint{1, {0, 1, 0}, 1280, 720};

// Pixels determine the time, the prior determines the error.
Forecasts calibrated(double full_ms) {
  Forecasts out = quality::Table(quality::Kind{}).forecasts(viewpoint);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double slabs = settings[i].method == protocol::MethodName::slab ? 4 : 1;
    out[i].ms = full_ms * slabs * settings[i].thinner *
                std::pow(2.0, -settings[i].half_level - 2 * settings[i].coarser);
    out[i].spread = 0.2;
    out[i].timed = true;
  }
  return out;
}

struct Drag {
  Forecasts tables;
  FrameTimes times{[this](const auto& /*signature*/, const auto& /*viewpoint*/) { return tables; }};
  Chooser chooser;
  protocol::View view;
  Micros now = 0;

  // Settings of `count` frames. A setting takes `slower` times its forecast.
  std::vector<std::size_t> run(const Forecasts& known, const quality::Aim& aim, int count,
                               const std::function<double(int frame)>& slower) {
    tables = known;
    std::vector<std::size_t> drawn;
    for (int n = 0; n < count; ++n) {
      const Forecasts expected = times.forecast(view, now).settings;
      const std::size_t setting = chooser.choose(view, expected, aim, no_limit, now);
      drawn.push_back(setting);
      now += frame_us;
      const auto cost = static_cast<Micros>(1000 * slower(n) * known[setting].ms);
      if (times.learn(setting, cost, view, now)) chooser.restart();
    }
    return drawn;
  }
};

double always(int /*frame*/) { return 1; }

TEST(Chooser, CorrectsForecastsByMeasuredFrames) {
  Drag drag;
  const Forecasts known = calibrated(100);
  const auto drawn = drag.run(known, {50.0, std::nullopt}, 30, [](int) { return 3.0; });
  for (std::size_t n = 2; n < drawn.size(); ++n) EXPECT_LE(3 * known[drawn[n]].ms, 50) << n;
  const double expected = drag.times.forecast(drag.view, drag.now).settings[drawn.back()].ms;
  EXPECT_NEAR(expected, 3 * known[drawn.back()].ms, 0.05 * expected);
}

TEST(Chooser, CoarsensAtOnceAndRefinesWithHysteresis) {
  Drag drag;
  const Forecasts known = calibrated(100);
  const quality::Aim aim{30.0, std::nullopt};
  const auto calm = drag.run(known, aim, 20, always);
  const auto busy = drag.run(known, aim, 60, [](int) { return 8.0; });
  EXPECT_EQ(busy[0], calm.back());
  EXPECT_LT(known[busy[1]].ms, known[calm.back()].ms) << "the frame after the first late one";
  const auto after = drag.run(known, aim, 300, always);
  for (int n = 0; n < Chooser::slack_frames - 1; ++n) EXPECT_EQ(after[n], busy.back()) << n;
  EXPECT_EQ(after.back(), calm.back());
}

TEST(Chooser, DoesNotOscillateWhenCostsVary) {
  Drag drag;
  const Forecasts known = calibrated(100);
  const auto drawn = drag.run(known, {40.0, std::nullopt}, 400, [](int n) {
    return n % 3 == 0 ? 1.12 : n % 3 == 1 ? 0.88 : 1.0;
  });
  int changes = 0;
  for (std::size_t n = 21; n < drawn.size(); ++n) changes += drawn[n] != drawn[n - 1] ? 1 : 0;
  EXPECT_LE(changes, 4);
}

TEST(Chooser, FastestSettingWithinTheErrorIsChosen) {
  const Forecasts known = calibrated(100);
  for (const double most : {0.2, 0.08, 0.03, 0.005}) {
    Drag drag;
    const std::size_t chosen = drag.run(known, {std::nullopt, most}, 30, always).back();
    ASSERT_LE(quality::error_bound(known[chosen]), most);
    for (std::size_t i = 0; i < settings.size(); ++i) {
      if (!quality::is_allowed(settings[i], drag.view)) continue;
      if (quality::error_bound(known[i]) > most) continue;
      EXPECT_LE(known[chosen].ms, known[i].ms);
    }
  }
}

// Without a calibration run times of finer pictures are only estimates, tried one by one.
TEST(Chooser, WithoutACalibrationRunFinerPicturesAreTriedOneByOne) {
  Drag drag;
  const Forecasts guessed = quality::Table(quality::Kind{}).forecasts(viewpoint);
  const quality::Aim aim{30.0, std::nullopt};
  // First ten times as slow as estimated, then a tenth of the estimate.
  const auto slow = drag.run(guessed, aim, 20, [](int) { return 10.0; });
  std::vector<std::size_t> fast;
  for (int n = 0; n < 20; ++n) {
    drag.now += 300'000;
    const auto part = drag.run(guessed, aim, 6, [](int) { return 0.5; });
    fast.insert(fast.end(), part.begin(), part.end());
  }
  EXPECT_LT(guessed[slow.back()].ms, 3);
  EXPECT_LT(guessed[fast.back()].error, guessed[slow.back()].error);
  EXPECT_LE(0.5 * guessed[fast.back()].ms, 30);
}

// A try that did not fit doubles the wait once, also if the same setting, chosen then for its
// measured time, does not fit either.
TEST(Chooser, OnlyATryThatDidNotFitPostponesTheNextOne) {
  Chooser chooser;
  const protocol::View view;
  Micros now = 0;
  const auto frames = [&](double full_ms, bool timed, int count) {
    Forecasts known = calibrated(full_ms);
    for (quality::Forecast& one : known) one.timed = timed;
    std::size_t chosen = 0;
    for (int n = 0; n < count; ++n) {
      now += frame_us;
      chosen = chooser.choose(view, known, {30.0, std::nullopt}, no_limit, now);
    }
    return chosen;
  };
  chooser.restart();
  const std::size_t coarse = frames(100, false, 1);
  const std::size_t fine = frames(50, false, Chooser::slack_frames);
  const Micros tried_at = now;
  ASSERT_LT(settings[fine].half_level, settings[coarse].half_level) << "it is tried";
  ASSERT_EQ(frames(100, false, 1), coarse) << "it did not fit";
  ASSERT_EQ(frames(50, true, Chooser::slack_frames), fine) << "by its measured time";
  ASSERT_EQ(frames(100, false, 1), coarse);
  ASSERT_LT(now - tried_at, 500'000);
  while (frames(50, false, 1) == coarse && now - tried_at < 20'000'000) continue;
  EXPECT_NEAR(static_cast<double>(now - tried_at), 8e6, 6e5);
}

TEST(Chooser, ExcludesPicturesTheLinkCannotCarry) {
  Chooser chooser;
  const Forecasts known = calibrated(10);
  const protocol::View view;
  const std::size_t chosen = chooser.choose(view, known, {100.0, std::nullopt}, 100'000, 0);
  EXPECT_LE(quality::pixels_at(view, settings[chosen]), 100'000);
  EXPECT_GT(quality::pixels_at(view, settings[chosen]), 40'000);
}

// What the last view shows says nothing about another scene or dataset.
TEST(FrameTimes, ContentIsOfTheSameSceneOnly) {
  std::vector<quality::Viewpoint> asked;
  FrameTimes times{[&](const auto& /*signature*/, const quality::Viewpoint& at) {
    asked.push_back(at);
    return calibrated(10);
  }};
  protocol::View view;
  Drawn drawn;
  drawn.viewpoint = viewpoint;
  drawn.viewpoint.detail = 2;
  drawn.viewpoint.content.emplace();
  times.complete(view, drawn);
  static_cast<void>(times.forecast(view, 0));
  EXPECT_TRUE(asked.back().content);
  protocol::View other = view;
  other.vector.length = 7;
  static_cast<void>(times.forecast(other, 0));
  EXPECT_FALSE(asked.back().content);
  times.forget();
  static_cast<void>(times.forecast(view, 0));
  EXPECT_FALSE(asked.back().content);
  EXPECT_EQ(asked.back().detail, 0);
}

}  // namespace
}  // namespace windsplat::session
