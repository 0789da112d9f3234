// The chooser and the times it relies on: measured times correct forecasts; finer settings are
// chosen with hysteresis, coarser ones at once.
#include "server/session/pacing/chooser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "server/session/pacing/frame_times.hpp"

namespace windsplat::session {
namespace {

using quality::Forecasts;
using quality::settings;

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

double ms_at(const Forecasts& known, const quality::Setting& setting) {
  return quality::forecast_between(setting, known).ms;
}

double error_at(const Forecasts& known, const quality::Setting& setting) {
  return quality::forecast_between(setting, known).error;
}

constexpr double no_limit = std::numeric_limits<double>::infinity();

struct Drag {
  Drag() {
    Drawn drawn;
    drawn.viewpoint = viewpoint;
    times.complete(view, drawn);
  }

  Forecasts tables;
  FrameTimes times{[this](const auto& /*signature*/, const auto& /*viewpoint*/) { return tables; }};
  Chooser chooser;
  protocol::View view;
  Micros now = 0;
  Micros calm = Chooser::calm;

  // Settings of `count` frames. A setting takes `slower` times its forecast.
  std::vector<quality::Setting> run(const Forecasts& known, const quality::Aim& aim, int count,
                                    const std::function<double(int frame)>& slower,
                                    bool may_try = true) {
    tables = known;
    std::vector<quality::Setting> drawn;
    for (int n = 0; n < count; ++n) {
      const quality::Setting setting = chooser.choose(
          view, times.forecast(view, now), aim, {no_limit, calm}, [&] { return may_try; }, now);
      drawn.push_back(setting);
      now += frame_us;
      const auto cost = static_cast<Micros>(1000 * slower(n) * ms_at(known, setting));
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
  for (std::size_t n = 2; n < drawn.size(); ++n) EXPECT_LE(3 * ms_at(known, drawn[n]), 50) << n;
  const double expected = ms_at(drag.times.forecast(drag.view, drag.now).settings, drawn.back());
  EXPECT_NEAR(expected, 3 * ms_at(known, drawn.back()), 0.05 * expected);
}

// One late frame may be a disturbance; a second one is not.
TEST(Chooser, FramesFarBeyondTheBudgetCoarsenAtOnceAndOthersStepByStep) {
  Drag drag;
  const Forecasts known = calibrated(100);
  const quality::Aim aim{30.0, std::nullopt};
  const auto calm = drag.run(known, aim, 40, always);
  const auto busy = drag.run(known, aim, 60, [](int) { return 8.0; });
  EXPECT_EQ(busy[0], calm.back());
  EXPECT_EQ(busy[1], calm.back());
  EXPECT_LT(ms_at(known, busy[2]), 0.7 * ms_at(known, calm.back()));
  const auto after = drag.run(known, aim, 400, always);
  for (int n = 0; n < Chooser::patient_frames - 1; ++n) EXPECT_EQ(after[n], busy.back()) << n;
  EXPECT_NEAR(ms_at(known, after.back()), ms_at(known, calm.back()), 3);
}

struct Changes {
  int count = 0;
  Micros least_apart = std::numeric_limits<Micros>::max();
  int widest = 0;  // sixteenths of a halving
};

Changes changes_in(const std::vector<quality::Setting>& drawn) {
  Changes out;
  int since = -1;
  for (int n = 1; n < static_cast<int>(drawn.size()); ++n) {
    if (drawn[n] == drawn[n - 1]) continue;
    ++out.count;
    out.widest = std::max(out.widest, quality::sizes_apart(drawn[n], drawn[n - 1]));
    if (since >= 0) out.least_apart = std::min(out.least_apart, (n - since) * frame_us);
    since = n;
  }
  return out;
}

// Load that swings by a sixth within seconds, with a frame of three times the time now and then.
double swinging(int n) {
  return (1 + 0.16 * std::sin(0.05 * n)) * (1 + 0.12 * std::cos(2.1 * n)) * (n % 37 == 0 ? 3 : 1);
}

TEST(Chooser, SteadyDragChangesItsSizeAtMostOnceASecondByOneStep) {
  for (const double budget : {12.0, 33.0, 66.0}) {
    Drag drag;
    const Forecasts known = calibrated(100);
    const quality::Aim aim{budget, std::nullopt};
    (void)drag.run(known, aim, 5, swinging);
    const auto drawn = drag.run(known, aim, 1200, swinging);
    const Changes changes = changes_in(drawn);
    EXPECT_GT(changes.count, 0);
    EXPECT_GE(changes.least_apart, Chooser::calm) << budget;
    EXPECT_LE(changes.widest, quality::sixteenths_per_half_level) << budget;
  }
}

// Such changes cost a key frame of video each.
TEST(Chooser, LinkOnWhichChangesAreDearMakesThemRarer) {
  const Forecasts known = calibrated(100);
  const auto changes_with = [&](Micros calm) {
    Drag drag;
    drag.calm = calm;
    (void)drag.run(known, {33.0, std::nullopt}, 5, swinging);
    return changes_in(drag.run(known, {33.0, std::nullopt}, 1200, swinging));
  };
  const Changes usual = changes_with(Chooser::calm);
  const Changes rare = changes_with(4 * Chooser::calm);
  EXPECT_GE(rare.count, 1);
  EXPECT_LE(2 * rare.count, usual.count);
}

TEST(Chooser, DoesNotOscillateWhenCostsVary) {
  Drag drag;
  const Forecasts known = calibrated(100);
  const auto drawn = drag.run(known, {40.0, std::nullopt}, 400, [](int n) {
    return n % 3 == 0 ? 1.12 : n % 3 == 1 ? 0.88 : 1.0;
  });
  EXPECT_LE(changes_in({drawn.begin() + 21, drawn.end()}).count, 2);
}

TEST(Chooser, UsesMostOfTheBudgetWhereThatLowersTheError) {
  for (const double full_ms : {40.0, 100.0, 300.0}) {
    const Forecasts known = calibrated(full_ms);
    quality::Sizes sizes;
    for (double budget = 8; budget < 90; budget *= 1.2) {
      Drag drag;
      const quality::Setting drawn = drag.run(known, {budget, std::nullopt}, 100, always).back();
      EXPECT_LE(ms_at(known, drawn), budget) << full_ms;
      if (ms_at(known, drawn) >= 0.8 * budget) continue;
      // Nothing that fits is much better.
      for (const auto& option : quality::options_of(drag.view, known, quality::Halvings{}, sizes)) {
        if (quality::is_finer(option.setting, drag.view)) continue;
        if (option.forecast.ms > 0.92 * budget) continue;
        EXPECT_GE(option.forecast.error, 0.97 * error_at(known, drawn))
            << full_ms << " within " << budget;
      }
    }
  }
}

TEST(Chooser, FastestSettingWithinTheErrorIsChosen) {
  const Forecasts known = calibrated(100);
  for (const double most : {0.2, 0.08, 0.03, 0.005}) {
    Drag drag;
    const quality::Setting chosen = drag.run(known, {std::nullopt, most}, 300, always).back();
    ASSERT_LE(quality::error_bound(quality::forecast_between(chosen, known)), most);
    for (std::size_t i = 0; i < settings.size(); ++i) {
      if (!quality::is_allowed(settings[i], drag.view)) continue;
      if (quality::error_bound(known[i]) > most) continue;
      EXPECT_LE(ms_at(known, chosen), 1.12 * known[i].ms) << "a change must be worth it";
    }
  }
}

// Without a calibration run times of finer pictures are only estimates, tried one by one.
TEST(Chooser, WithoutACalibrationRunFinerPicturesAreTriedOneByOne) {
  Drag drag;
  const Forecasts guessed = quality::Table(quality::Kind{}).forecasts(viewpoint);
  const quality::Aim aim{30.0, std::nullopt};
  // First ten times as slow as estimated, then half of the estimate.
  const auto slow = drag.run(guessed, aim, 60, [](int) { return 10.0; });
  const auto fast = drag.run(guessed, aim, 900, [](int) { return 0.5; });
  EXPECT_LT(ms_at(guessed, slow.back()), 3);
  EXPECT_LT(error_at(guessed, fast.back()), error_at(guessed, slow.back()));
  EXPECT_LE(0.5 * ms_at(guessed, fast.back()), 30);
  EXPECT_GE(changes_in({fast.begin() + 40, fast.end()}).least_apart, Chooser::calm);

  Drag waiting;
  (void)waiting.run(guessed, aim, 60, [](int) { return 10.0; });
  const auto held = waiting.run(
      guessed, aim, 900, [](int) { return 0.5; }, false);
  EXPECT_GT(error_at(guessed, held.back()), error_at(guessed, fast.back()))
      << "nothing is tried while frames wait for the renderer";
}

// A try that did not fit doubles the wait once, also if the same setting, chosen then for its
// measured time, does not fit either.
TEST(Chooser, OnlyATryThatDidNotFitPostponesTheNextOne) {
  Chooser chooser;
  const protocol::View view;
  Micros now = 0;
  const auto frames = [&](double full_ms, bool timed, int count) {
    FrameForecast known{calibrated(full_ms)};
    for (quality::Forecast& one : known.settings) one.timed = timed;
    quality::Setting chosen;
    for (int n = 0; n < count; ++n) {
      now += frame_us;
      chosen = chooser.choose(
          view, known, {30.0, std::nullopt}, {}, [] { return true; }, now);
    }
    return chosen;
  };
  const int patient = 1 + static_cast<int>(Chooser::calm / frame_us);
  chooser.restart();
  const quality::Setting coarse = frames(100, false, 1);
  const quality::Setting fine = frames(50, false, patient + 1);
  const Micros tried_at = now;
  ASSERT_LT(fine.half_level, coarse.half_level) << "it is tried";
  ASSERT_EQ(frames(100, false, 1), coarse) << "it did not fit";
  ASSERT_EQ(frames(50, true, patient + 1), fine) << "by its measured time";
  ASSERT_EQ(frames(100, false, 1), coarse);
  ASSERT_LT(now - tried_at, 1'500'000);
  while (frames(50, false, 1) == coarse && now - tried_at < 20'000'000) continue;
  EXPECT_NEAR(static_cast<double>(now - tried_at), 8e6, 6e5);
}

TEST(Chooser, ExcludesPicturesTheLinkCannotCarry) {
  Chooser chooser;
  const FrameForecast known{calibrated(10)};
  const protocol::View view;
  const quality::Setting chosen = chooser.choose(
      view, known, {100.0, std::nullopt}, {100'000}, [] { return true; }, 0);
  EXPECT_LE(quality::pixels_at(view, chosen), 100'000);
  EXPECT_GT(quality::pixels_at(view, chosen), 40'000);
}

// What the last view shows says nothing about another scene or dataset.
// Nothing is known of the scene but the number of its kernels.
struct FirstFrame {
  double work_ms = 0;  // of method kernel at full size
  protocol::View view;
  FrameTimes times{{}, [this](const protocol::View& /*view*/) { return work_ms; }};

  quality::Setting setting() const {
    Chooser chooser;
    return chooser.choose(
        view, times.forecast(view, 0), {33.0, std::nullopt}, {}, [] { return true; }, 0);
  }
};

TEST(FrameTimes, FirstFrameOfManySamplesMergesThem) {
  FirstFrame first;
  EXPECT_EQ(first.setting().coarser, 0) << "the work is unknown";
  first.work_ms = 5;
  EXPECT_EQ(first.setting().coarser, 0) << "every sample fits into the budget";
  first.work_ms = 800;
  const quality::Setting merged = first.setting();
  EXPECT_GT(merged.coarser, 0);
  EXPECT_LE(ms_at(first.times.forecast(first.view, 0).settings, merged), 33);
}

TEST(FrameTimes, MeasuredFramesReplaceTheTimesByWork) {
  FirstFrame first;
  first.work_ms = 800;
  const std::size_t own = quality::own_setting(first.view);
  EXPECT_GE(first.times.forecast(first.view, 0).settings[own].ms, 800);
  first.times.learn(quality::settings[own], 20'000, first.view, 0);
  EXPECT_LT(first.times.forecast(first.view, 0).settings[own].ms, 40);
}

// Otherwise a merged first frame would stay until a final one that takes seconds.
TEST(FrameTimes, FinalFramesOfManySamplesAreKnownToBeLong) {
  FirstFrame first;
  EXPECT_TRUE(first.times.forecast(first.view, 0).final_is_guessed);
  first.work_ms = 800;
  const FrameForecast forecast = first.times.forecast(first.view, 0);
  EXPECT_FALSE(forecast.final_is_guessed);
  EXPECT_GT(forecast.final_us, 2'000'000);
}

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
