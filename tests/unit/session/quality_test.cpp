// Settings of frames, their reported errors, and refinement to the final frame.
#include <cmath>
#include <functional>
#include <optional>
#include <string>

#include "driver.hpp"

namespace session_test {
namespace {

// --- settings -----------------------------------------------------------------------------------

// Results of a calibration run where a full kernel picture takes `full_ms`: time is proportional to
// pixels and samples, slabs take four times as long.
quality::Forecasts calibrated(double full_ms) {
  quality::Forecasts out = quality::Table(quality::Kind{}).forecasts({1, {0, 1, 0}, 1280, 720});
  for (std::size_t i = 0; i < out.size(); ++i) {
    const quality::Setting& setting = quality::settings[i];
    const double slabs = setting.method == protocol::MethodName::slab ? 4 * setting.thinner : 1;
    out[i].ms = full_ms * slabs * std::pow(2.0, -setting.half_level - 2 * setting.coarser);
    out[i].spread = 0.2;
    out[i].timed = true;
  }
  return out;
}

// Settings of `count` dragged frames whose cost depends on the setting.
std::vector<quality::Setting> drag(Driver& driver, int count, std::uint32_t& rev,
                                   const std::function<Micros(const quality::Setting&)>& cost) {
  std::vector<quality::Setting> drawn;
  for (int n = 0; n < count; ++n) {
    driver.patch(++rev, azimuth(n));
    if (!driver.render) continue;
    const quality::Setting setting = driver.render->setting;
    drawn.push_back(setting);
    driver.finish_render(cost(setting));
    driver.ack(driver.frames.back().header.seq);
  }
  return drawn;
}

// Time of a setting on a machine that is `slower` times as slow as the calibrated one.
std::function<Micros(const quality::Setting&)> costs(const quality::Forecasts& known,
                                                     double slower = 1) {
  return [known, slower](const quality::Setting& setting) {
    return static_cast<Micros>(1000 * slower * quality::forecast_between(setting, known).ms);
  };
}

TEST(Setting, IsReportedInTheHeaderAndTheFinalFrameIsFull) {
  Driver driver;
  driver.calibrated = calibrated(400);
  driver.patch(1, R"({"dataset":"wind","image":{"width":800,"height":600}})");
  std::uint32_t rev = 1;
  const auto drawn = drag(driver, 10, rev, costs(*driver.calibrated));
  const auto moving = driver.frames.back().header;
  ASSERT_GT(drawn.back().half_level, 0);
  EXPECT_EQ(moving.level, drawn.back().half_level / 2);
  EXPECT_EQ(moving.width, quality::size_at({800, 600}, drawn.back()).width);
  EXPECT_EQ(moving.flags, protocol::flag_error_estimated);
  EXPECT_FLOAT_EQ(
      moving.error,
      static_cast<float>(quality::forecast_between(drawn.back(), *driver.calibrated).error));
  driver.measured_error = 3e-4;
  driver.settle(400 * ms);
  const auto final = driver.frames.back().header;
  EXPECT_EQ(final.level, 0);
  EXPECT_EQ(final.width, 800);
  EXPECT_EQ(final.height, 600);
  EXPECT_EQ(final.flags, protocol::flag_final | protocol::flag_error_measured);
  EXPECT_FLOAT_EQ(final.error, 3e-4F);
}

TEST(Setting, KeepsTheBudgetOnASlowedMachine) {
  for (const double budget : {16.0, 33.0, 66.0, 100.0}) {
    Driver driver;
    driver.calibrated = calibrated(120);
    driver.patch(1, R"({"dataset":"wind","quality":{"budgetMs":)" + std::to_string(budget) + "}}");
    std::uint32_t rev = 1;
    const auto cost = costs(*driver.calibrated, 2.5);
    driver.finish_render(cost(driver.render->setting));
    driver.ack(1);
    const auto drawn = drag(driver, 60, rev, cost);
    ASSERT_GE(drawn.size(), 60U);
    for (std::size_t n = 10; n < drawn.size(); ++n) {
      EXPECT_LE(cost(drawn[n]), 1000 * budget) << "frame " << n << " at " << budget << " ms";
    }
    // Among the settings well within the budget none has a smaller error.
    const auto error = [&](const quality::Setting& setting) {
      return quality::forecast_between(setting, *driver.calibrated).error;
    };
    for (const quality::Setting& setting : quality::settings) {
      if (!quality::is_allowed(setting, driver.render ? driver.render->view : View{})) continue;
      if (cost(setting) > 800 * budget) continue;
      EXPECT_LE(error(drawn.back()), error(setting)) << budget << " ms";
    }
  }
}

TEST(Setting, OneSlowLoadDoesNotCoarsenLaterFrames) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  std::uint32_t rev = 1;
  const auto before = drag(driver, 10, rev, [](const quality::Setting&) { return 10 * ms; }).back();
  driver.patch(++rev, R"({"step":3})");
  driver.finish_render(900 * ms, true);
  driver.ack(driver.frames.back().header.seq);
  driver.patch(++rev, azimuth(99));
  ASSERT_TRUE(driver.render);
  EXPECT_LE(driver.render->setting.half_level, before.half_level);
  EXPECT_LE(driver.render->setting.coarser, before.coarser);
}

TEST(Setting, FramesOfDataThatStandInDoNotPredictTheTimeOfOthers) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  std::uint32_t rev = 1;
  const auto cost = [](const quality::Setting& setting) {
    return (100 * ms) >> (2 * setting.half_level + 2 * setting.coarser);
  };
  const auto before = drag(driver, 30, rev, cost).back();
  driver.missing_bytes = 1000;
  const auto meanwhile =
      drag(driver, 500, rev, [](const quality::Setting&) { return 5 * ms; }).back();
  EXPECT_EQ(meanwhile, before);
}

TEST(Setting, KeepsAMinimumPictureSize) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","image":{"width":300,"height":200}})");
  std::uint32_t rev = 1;
  const auto drawn = drag(driver, 10, rev, [](const quality::Setting&) { return 5000 * ms; });
  for (const quality::Setting& setting : drawn) {
    EXPECT_GE(quality::size_at({300, 200}, setting).height, 64);
  }
}

TEST(Setting, RecoversWhenTheSceneBecomesCheap) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  std::uint32_t rev = 1;
  const quality::Forecasts dear = calibrated(400);
  const auto coarse = drag(driver, 20, rev, costs(dear));
  ASSERT_NE(coarse.back(), quality::settings[0]) << "which would take 400 ms";
  driver.wait(5000 * ms);
  const quality::Forecasts cheap = calibrated(16);
  const auto fine = drag(driver, 1000, rev, costs(cheap));
  EXPECT_EQ(fine.back().half_level, 0);
  EXPECT_EQ(fine.back().coarser, 0);
}

TEST(Setting, RequestedErrorReplacesTheBudget) {
  Driver driver;
  driver.calibrated = calibrated(120);
  const double of_kernel = (*driver.calibrated)[0].error;
  driver.patch(1, R"({"dataset":"wind","quality":{"maxError":)" + std::to_string(of_kernel) + "}}");
  std::uint32_t rev = 1;
  driver.finish_render(costs(*driver.calibrated)(driver.render->setting));
  driver.ack(1);
  const auto drawn = drag(driver, 20, rev, costs(*driver.calibrated));
  EXPECT_EQ(drawn.back().method, protocol::MethodName::slab) << "at any cost";
  driver.patch(++rev, R"({"quality":{"budgetMs":16}})");
  const auto late = drag(driver, 20, rev, costs(*driver.calibrated));
  EXPECT_EQ(late.back().method, protocol::MethodName::kernel) << "a budget has precedence";
}

// Sixteen equal sessions: each waits for fifteen frames of the others, and all shorten their
// frames.
TEST(Setting, FramesBecomeCheaperWhenManyWaitForTheRenderer) {
  Driver driver;
  driver.calibrated = calibrated(33);
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  std::uint32_t rev = 1;
  const auto cost = costs(*driver.calibrated);
  drag(driver, 20, rev, cost);
  Micros own = cost(driver.render ? driver.render->setting : quality::settings[0]);
  EXPECT_GT(own, 16 * ms);
  for (int n = 0; n < 80; ++n) {
    driver.queue = 15 * own;
    own = cost(drag(driver, 1, rev, cost).back());
  }
  EXPECT_LE(own, 9 * ms) << "33 ms over the root of 16";
  EXPECT_GE(own, 4 * ms);
}

// Its first frame is as cheap as those of the sessions that have adapted to the wait.
TEST(Setting, NewSessionStartsFromTheWaitOfTheOthers) {
  const auto first = [](Micros waiting) {
    Driver driver;
    driver.waiting = waiting;
    driver.calibrated = calibrated(100);
    driver.patch(1, R"({"dataset":"wind"})");
    driver.finish_render(10 * ms);
    driver.ack(1);
    driver.patch(2, azimuth(2));
    return driver.render->setting;
  };
  const auto known = calibrated(100);
  EXPECT_LE(quality::forecast_between(first(140 * ms), known).ms,
            0.5 * quality::forecast_between(first(0), known).ms);
}

// --- refinement to the final frame ---------------------------------------------------------------

TEST(Refining, LongFinalFrameIsPrecededByABetterOne) {
  Driver driver;
  driver.calibrated = calibrated(200);
  driver.measured_error = 5e-4;
  driver.patch(1, R"({"dataset":"wind"})");
  std::uint32_t rev = 1;
  const auto cost = costs(*driver.calibrated);
  drag(driver, 20, rev, cost);
  if (driver.render) driver.finish_render(cost(driver.render->setting));  // of the last patch
  driver.ack(driver.frames.back().header.seq);
  const std::size_t moved = driver.frames.size();
  driver.wait(200 * ms);
  std::vector<quality::Setting> drawn;
  while (driver.render) {
    drawn.push_back(driver.render->setting);
    driver.finish_render(cost(driver.render->setting));
    driver.ack(driver.frames.back().header.seq);
    driver.wait(200 * ms);
  }
  ASSERT_GE(drawn.size(), 2U);
  float before = driver.frames[moved - 1].header.error;
  for (std::size_t n = moved; n < driver.frames.size(); ++n) {
    EXPECT_LE(driver.frames[n].header.error, 0.5F * before) << "each refinement is worth its time";
    before = driver.frames[n].header.error;
    EXPECT_EQ(Driver::is_final(driver.frames[n]), n + 1 == driver.frames.size());
  }
  EXPECT_EQ(drawn.back(), quality::settings[quality::own_setting(View{})]);
}

// Small pictures: thinner slabs take next to no time.
TEST(Refining, FinalFrameIsTheFinestShownWhateverWasShownBefore) {
  const std::string view =
      R"({"dataset":"wind","image":{"width":160,"height":120},"camera":{"eye":[1,-3,1]}})";
  for (const char* quality : {R"({})", R"({"budgetMs":500})", R"({"maxError":0.000005})"}) {
    std::vector<quality::Setting> finals;
    for (const int dragged : {0, 1, 40}) {
      Driver driver;
      driver.calibrated = calibrated(0.5);
      driver.measured_error = 5e-7;
      driver.patch(1, view);
      driver.patch(2, std::string(R"({"quality":)") + quality + "}");
      std::uint32_t rev = 2;
      std::vector<quality::Setting> moving = drag(driver, dragged, rev, costs(*driver.calibrated));
      driver.patch(++rev, view);
      std::optional<quality::Setting> last;
      for (int turns = 0; turns < 50 && !(last && !driver.render); ++turns) {
        if (driver.render) {
          if (driver.render->encoding.measure) {
            last = driver.render->setting;
          } else {
            moving.push_back(driver.render->setting);
          }
          driver.finish_render(1 * ms);
        }
        if (!driver.frames.empty()) driver.ack(driver.frames.back().header.seq);
        driver.wait(200 * ms);
      }
      ASSERT_TRUE(last);
      finals.push_back(*last);
      for (const quality::Setting& shown : moving) {
        EXPECT_LE(shown.thinner, last->thinner) << quality << " after " << dragged;
      }
    }
    for (const quality::Setting& final : finals) EXPECT_EQ(final, finals.front()) << quality;
  }
}

TEST(Refining, IsCancelledByTheNextChange) {
  Driver driver;
  driver.calibrated = calibrated(200);
  driver.patch(1, R"({"dataset":"wind"})");
  std::uint32_t rev = 1;
  const auto cost = costs(*driver.calibrated);
  drag(driver, 10, rev, cost);
  if (driver.render) driver.finish_render(cost(driver.render->setting));
  driver.ack(driver.frames.back().header.seq);
  driver.wait(200 * ms);
  ASSERT_TRUE(driver.render);
  ASSERT_FALSE(driver.render->encoding.measure) << "not yet the final one";
  driver.patch(++rev, azimuth(200));
  EXPECT_TRUE(driver.cancelled);
}

TEST(Refining, SlabsBecomeThinnerUntilTheRequestedErrorIsMet) {
  Driver driver;
  driver.measured_error = 1e-3;  // a quarter with every halving
  driver.patch(1, R"({"dataset":"wind","quality":{"maxError":0.0001}})");
  driver.settle();
  ASSERT_GE(driver.frames.size(), 3U);
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  EXPECT_LE(driver.frames.back().header.error, 1e-4F);
  for (std::size_t n = 0; n + 1 < driver.frames.size(); ++n) {
    EXPECT_FALSE(Driver::is_final(driver.frames[n])) << n;
  }
}

TEST(Refining, EndsWhereThinnerSlabsDoNotHelp) {
  Driver driver;
  driver.averaged = true;
  driver.measured_error = 1e-2;
  driver.patch(1, R"({"dataset":"wind","quality":{"maxError":0.003}})");
  driver.settle();
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  EXPECT_EQ(driver.frames.back().header.error, 1e-2F);
  EXPECT_LE(driver.frames.size(), 3U) << "one moving frame, one halving tried";
}

TEST(Setting, LateFrameOfAnotherDatasetIsIgnored) {
  const auto first_of_sea = [](Micros late) {
    Driver driver;
    driver.calibrated = calibrated(10);
    driver.patch(1, R"({"dataset":"wind"})");
    driver.patch(2, R"({"dataset":"sea"})");
    driver.finish_render(late);
    driver.ack(driver.frames.empty() ? 0 : driver.frames.back().header.seq);
    EXPECT_TRUE(driver.render);
    EXPECT_EQ(driver.render->view.dataset, "sea");
    return driver.render->setting;
  };
  EXPECT_EQ(first_of_sea(2000 * ms), first_of_sea(10 * ms));
}

TEST(Refining, EndsWhereNoSlabIsThinEnough) {
  Driver driver;
  driver.measured_error = 1;
  driver.patch(1, R"({"dataset":"wind","quality":{"maxError":0.000005}})");
  driver.settle();
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  EXPECT_GT(driver.frames.back().header.error, 5e-6F) << "reports that the error limit is not met";
}

TEST(Refining, LosslessFinalFrameIsAPng) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","quality":{"lossless":true}})");
  driver.settle();
  ASSERT_GE(driver.frames.size(), 2U);
  EXPECT_EQ(driver.frames.front().header.codec, protocol::Codec::jpeg);
  EXPECT_EQ(driver.frames.back().header.codec, protocol::Codec::png);
}

// A still cancels the calibration, which describes the view.
TEST(Refining, ViewAtRestIsCalibratedAgainAfterItsLastStill) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  ASSERT_EQ(driver.calibrations.size(), 1U);
  for (std::uint32_t id = 1; id <= 2; ++id) {
    protocol::StillMessage still;
    still.id = id;
    driver.say(still);
  }
  EXPECT_EQ(driver.calibrations.size(), 1U);
  driver.finish_render(10 * ms);
  EXPECT_EQ(driver.calibrations.size(), 1U) << "the second still would cancel it";
  driver.settle();
  EXPECT_EQ(driver.calibrations.size(), 2U);
}

TEST(Refining, ViewAtRestIsCalibratedOnce) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  EXPECT_TRUE(driver.calibrations.empty());
  driver.settle();
  driver.wait(5000 * ms);
  EXPECT_EQ(driver.calibrations.size(), 1U);
  driver.say(play(0, 9, 20, true, true));
  for (int n = 0; n < 40; ++n) {
    if (driver.render) driver.finish_render(10 * ms);
    driver.ack(driver.frames.back().header.seq);
    driver.wait(10 * ms);
  }
  EXPECT_EQ(driver.calibrations.size(), 1U) << "not during playback";
}

}  // namespace
}  // namespace session_test
