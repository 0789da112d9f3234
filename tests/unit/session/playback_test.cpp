// Playback: order, rate, changes during playback, statistics, and prefetch requests.
#include <gmock/gmock.h>

#include <numeric>

#include "driver.hpp"

namespace session_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// A dataset of `steps` steps at rest at `step`, with the recorded history cleared.
void rest_at(Driver& driver, int step) {
  driver.patch(1, R"({"dataset":"wind","step":)" + std::to_string(step) + "}");
  driver.settle();
  driver.frames.clear();
  driver.texts.clear();
  driver.requests.clear();
}

// Renders each frame in `cost` and acknowledges it, for `duration`.
void run_and_acknowledge(Driver& driver, Micros duration, Micros cost, bool loaded = false) {
  const Micros end = driver.now() + duration;
  while (driver.now() < end) {
    if (driver.render) {
      driver.finish_render(cost, loaded);
      if (!driver.frames.empty()) driver.ack(driver.frames.back().header.seq);
    } else {
      driver.wait(1 * ms);
    }
  }
}

std::vector<std::uint32_t> moving_steps(const Driver& driver) {
  std::vector<std::uint32_t> steps;
  for (const SendFrame& frame : driver.frames) {
    if (!Driver::is_final(frame)) steps.push_back(frame.header.step);
  }
  return steps;
}

// --- order --------------------------------------------------------------------------------------

TEST(Reverse, RunsDownAndRestartsAtTheTop) {
  Driver driver;
  rest_at(driver, 2);
  driver.say(play(4, 0, 10, true, true));
  run_and_acknowledge(driver, 650 * ms, 10 * ms);
  EXPECT_THAT(moving_steps(driver), ElementsAre(1U, 0U, 4U, 3U, 2U, 1U));
}

TEST(Reverse, WithoutLoopEndsAtTheFirstStepAndMakesItFinal) {
  Driver driver;
  rest_at(driver, 2);
  driver.say(play(9, 0, 10, false, true));
  run_and_acknowledge(driver, 1500 * ms, 10 * ms);
  EXPECT_THAT(moving_steps(driver), ElementsAre(1U, 0U));
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  driver.frames.clear();
  driver.say(play(9, 0, 10, false, true));  // at the end of the range it starts again
  run_and_acknowledge(driver, 150 * ms, 10 * ms);
  EXPECT_THAT(driver.steps_shown(), ElementsAre(9U, 8U));
}

TEST(Reverse, WithDropSkipsDownwardAndAcrossTheEnd) {
  Driver driver;
  rest_at(driver, 3);
  driver.say(play(9, 0, 10, true, true));
  driver.wait(105 * ms);
  ASSERT_EQ(driver.render->view.step, 2);
  driver.finish_render(500 * ms);  // steps 1 to 0 and 9 to 7 are skipped
  EXPECT_EQ(driver.render->view.step, 7);
}

TEST(Reverse, FromBeyondTheLastStepIsAnError) {
  Driver driver;
  rest_at(driver, 0);
  driver.say(play(steps, 0, 10, true, true));
  ASSERT_EQ(driver.errors().size(), 1U);
  EXPECT_EQ(driver.errors()[0].problem.errors.at(0).pointer, "/from");
}

// --- changes during playback --------------------------------------------------------------------

TEST(Seamless, FasterPaceContinuesFromThePresentStep) {
  Driver driver;
  rest_at(driver, 0);
  driver.say(play(0, 9, 1, true, true));
  run_and_acknowledge(driver, 1010 * ms, 5 * ms);  // step 1 was just shown
  driver.frames.clear();
  driver.say(play(0, 9, 10, true, true));
  run_and_acknowledge(driver, 350 * ms, 5 * ms);
  EXPECT_THAT(moving_steps(driver), ElementsAre(2U, 3U, 4U));
}

TEST(Seamless, RepeatedEqualMessagesDelayNothing) {
  Driver driver;
  rest_at(driver, 0);
  for (int n = 0; n < 20; ++n) {
    driver.say(play(0, 9, 10, true, true));
    run_and_acknowledge(driver, 22 * ms, 1 * ms);
  }
  EXPECT_THAT(moving_steps(driver), ElementsAre(1U, 2U, 3U, 4U));
}

TEST(Seamless, ReversalReturnsOverTheStepsJustShown) {
  Driver driver;
  rest_at(driver, 0);
  driver.say(play(0, 9, 10, true, true));
  run_and_acknowledge(driver, 340 * ms, 5 * ms);
  driver.say(play(9, 0, 10, true, true));
  run_and_acknowledge(driver, 300 * ms, 5 * ms);
  EXPECT_THAT(moving_steps(driver), ElementsAre(1U, 2U, 3U, 2U, 1U, 0U));
}

TEST(Seamless, DroppingFromNowOnDoesNotSkipLateSteps) {
  Driver driver;
  rest_at(driver, 0);
  driver.say(play(0, 9, 10, true, false));
  driver.wait(105 * ms);
  ASSERT_EQ(driver.render->view.step, 1);
  driver.wait(600 * ms);  // still rendering
  driver.say(play(0, 9, 10, true, true));
  driver.finish_render(1 * ms);
  EXPECT_EQ(driver.render->view.step, 2);
}

TEST(Seamless, LoopTurnedOffEndsAtTheLastStep) {
  Driver driver;
  rest_at(driver, 0);
  driver.say(play(0, 3, 10, true, true));
  run_and_acknowledge(driver, 320 * ms, 5 * ms);
  driver.say(play(0, 3, 10, false, true));
  run_and_acknowledge(driver, 600 * ms, 5 * ms);
  EXPECT_THAT(moving_steps(driver), ElementsAre(1U, 2U, 3U));
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
}

TEST(Seamless, SingleStepIsShownWithoutPlayback) {
  Driver driver;
  rest_at(driver, 5);
  driver.say(play(7, 7, 60, true, true));
  driver.settle();
  EXPECT_EQ(driver.frames.back().header.step, 7U);
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
}

TEST(EveryStep, IsShownDuringContinuousRotation) {
  Driver driver;
  rest_at(driver, 0);
  driver.say(play(0, 9, 20, false, false));
  std::uint32_t rev = 1;
  for (int n = 0; n < 120; ++n) {  // a patch every 10 ms, a frame takes 25 ms
    driver.patch(++rev, R"({"camera":{"fovY":)" + std::to_string(20 + n % 20) + "}}");
    run_and_acknowledge(driver, 10 * ms, 25 * ms);
  }
  const auto shown = moving_steps(driver);
  for (std::uint32_t step = 1; step < 10; ++step) EXPECT_THAT(shown, testing::Contains(step));
}

TEST(Scrub, AtRestShowsTheNewestOfManySteps) {
  Driver driver;
  rest_at(driver, 0);
  std::uint32_t rev = 1;
  driver.patch(++rev, R"({"step":1})");
  ASSERT_TRUE(driver.render);
  for (int step = 2; step <= 8; ++step) {
    driver.patch(++rev, R"({"step":)" + std::to_string(step) + "}");
    driver.wait(4 * ms);
  }
  driver.finish_render(10 * ms);
  ASSERT_TRUE(driver.render);
  EXPECT_EQ(driver.render->view.step, 8);
  driver.settle();
  EXPECT_THAT(driver.steps_shown(), ElementsAre(1U, 8U, 8U));
}

TEST(Hidden, StepsWaitUntilVisible) {
  Driver driver;
  rest_at(driver, 0);
  driver.say(play(0, 9, 10, true, true));
  run_and_acknowledge(driver, 210 * ms, 5 * ms);
  driver.say(protocol::VisibilityMessage{true});
  driver.wait(3370 * ms);  // not a whole number of loops
  driver.say(protocol::VisibilityMessage{false});
  driver.frames.clear();
  run_and_acknowledge(driver, 250 * ms, 5 * ms);
  EXPECT_THAT(moving_steps(driver), ElementsAre(3U, 4U));
}

// --- counts -------------------------------------------------------------------------------------

TEST(PlayStats, ReportThePaceAndThatNothingWasDropped) {
  Driver driver;
  rest_at(driver, 0);
  driver.say(play(0, 9, 25, true, true));
  run_and_acknowledge(driver, 3200 * ms, 10 * ms);
  const auto stats = driver.texts_of<protocol::StatsMessage>();
  ASSERT_EQ(stats.size(), 3U) << "one per second";
  for (const auto& told : stats) EXPECT_NEAR(told.play_fps.value_or(0), 25, 0.5);
  EXPECT_EQ(stats.back().steps_dropped, 0U);
  EXPECT_EQ(stats.back().steps_not_ready, 0U);
}

TEST(PlayStats, WithoutDropReportTheRenderingPace) {
  Driver driver;
  rest_at(driver, 0);
  driver.say(play(0, 9, 60, true, false));
  run_and_acknowledge(driver, 2200 * ms, 50 * ms);
  const auto stats = driver.texts_of<protocol::StatsMessage>();
  ASSERT_FALSE(stats.empty());
  EXPECT_NEAR(stats.back().play_fps.value_or(0), 20, 0.5);
  EXPECT_EQ(stats.back().steps_dropped, 0U);
}

TEST(PlayStats, ShownAndDroppedStepsAddUp) {
  for (const Micros cost : {30 * ms, 70 * ms, 130 * ms, 310 * ms}) {
    Driver driver;
    rest_at(driver, 0);
    driver.say(play(0, 9, 20, true, true));
    run_and_acknowledge(driver, 4020 * ms, cost);
    const int showing = driver.render ? 1 : 0;  // started, so it will be shown
    const auto shown = static_cast<std::int64_t>(moving_steps(driver).size()) + showing;
    driver.say(protocol::PauseMessage{});
    driver.settle();
    const auto stats = driver.texts_of<protocol::StatsMessage>().back();
    EXPECT_FALSE(stats.play_fps) << "nothing is running";
    // 20 steps per second for 4 s, and those during the last frame.
    const std::int64_t by = shown + static_cast<std::int64_t>(stats.steps_dropped);
    EXPECT_GE(by, 79);
    EXPECT_LE(by, 81 + cost / (50 * ms));
    if (cost < 50 * ms) {
      EXPECT_EQ(stats.steps_dropped, 0U);
    }
    if (cost > 100 * ms) {
      EXPECT_GT(stats.steps_dropped, 20U);
    }
  }
}

TEST(PlayStats, CountStepsThatWaitedForLoading) {
  Driver driver;
  rest_at(driver, 0);
  driver.say(play(0, 9, 10, true, true));
  run_and_acknowledge(driver, 305 * ms, 5 * ms, true);
  EXPECT_THAT(moving_steps(driver), ElementsAre(1U, 2U, 3U));
  driver.patch(2, R"({"camera":{"fovY":20}})");  // its frame is not the first one of the step
  run_and_acknowledge(driver, 20 * ms, 5 * ms, true);
  driver.say(protocol::PauseMessage{});
  driver.settle();
  EXPECT_EQ(driver.texts_of<protocol::StatsMessage>().back().steps_not_ready, 3U);
}

// --- prefetch -----------------------------------------------------------------------------------

std::vector<int> iota(int first, int count) {
  std::vector<int> out(static_cast<std::size_t>(count));
  std::iota(out.begin(), out.end(), first);
  return out;
}

TEST(PrefetchRequest, AtRestCoversTheNeighbors) {
  for (const auto& [step, wanted] : std::vector<std::pair<int, std::vector<int>>>{
           {0, {1}}, {4, {5, 3}}, {steps - 1, {steps - 2}}}) {
    Driver driver;
    driver.patch(1, R"({"dataset":"wind","step":)" + std::to_string(step) + "}");
    driver.finish_render();
    EXPECT_THAT(driver.requests, IsEmpty()) << "not before the final frame";
    driver.settle();
    ASSERT_EQ(driver.requests.size(), 1U) << "once, however often on_time() is called";
    EXPECT_EQ(driver.requests[0].steps, wanted);
    EXPECT_EQ(driver.requests[0].view.dataset, "wind");
    EXPECT_EQ(driver.requests[0].view.step, step);
  }
}

TEST(PrefetchRequest, SurvivesCameraMotionButNotAnotherStep) {
  Driver driver;
  rest_at(driver, 4);
  driver.patch(2, R"({"camera":{"fovY":20}})");
  driver.settle();
  EXPECT_THAT(driver.requests, IsEmpty());
  driver.patch(3, R"({"step":7})");
  ASSERT_EQ(driver.requests.size(), 1U);
  EXPECT_THAT(driver.requests[0].steps, IsEmpty());
  driver.settle();
  ASSERT_EQ(driver.requests.size(), 2U);
  EXPECT_THAT(driver.requests[1].steps, ElementsAre(8, 6));
}

TEST(PrefetchRequest, IsRenewedForOtherFields) {
  Driver driver;
  rest_at(driver, 4);
  driver.patch(2, R"({"scalars":[{"field":"salt"}]})");
  driver.settle();
  ASSERT_EQ(driver.requests.size(), 2U);
  EXPECT_THAT(driver.requests[0].steps, IsEmpty());
  EXPECT_THAT(driver.requests[1].steps, ElementsAre(5, 3));
  ASSERT_TRUE(driver.requests[1].view.scalars);
  EXPECT_EQ(driver.requests[1].view.scalars->at(0).field, "salt");
}

TEST(PrefetchRequest, DuringPlaybackCoversFollowingStepsInOrder) {
  Driver driver;
  rest_at(driver, 6);
  driver.say(play(0, 9, 10, true, true));
  ASSERT_EQ(driver.requests.size(), 1U);
  EXPECT_THAT(driver.requests[0].steps, ElementsAre(7, 8, 9, 0, 1, 2, 3, 4, 5)) << "each once";
  run_and_acknowledge(driver, 105 * ms, 5 * ms);
  ASSERT_EQ(driver.requests.size(), 2U);
  EXPECT_THAT(driver.requests[1].steps, ElementsAre(8, 9, 0, 1, 2, 3, 4, 5, 6));
  EXPECT_EQ(driver.requests[1].view.step, 7);
  driver.say(play(9, 0, 10, false, true));
  ASSERT_EQ(driver.requests.size(), 3U);
  EXPECT_THAT(driver.requests[2].steps, ElementsAre(6, 5, 4, 3, 2, 1, 0))
      << "without loop there are no more";
}

TEST(PrefetchRequest, EndsWithPlaybackAndReturnsAtRest) {
  Driver driver;
  rest_at(driver, 0);
  driver.say(play(0, 9, 10, true, true));
  run_and_acknowledge(driver, 305 * ms, 5 * ms);
  driver.say(protocol::PauseMessage{});
  EXPECT_THAT(driver.requests.back().steps, IsEmpty());
  driver.settle();
  EXPECT_THAT(driver.requests.back().steps, ElementsAre(4, 2));
}

TEST(PrefetchRequest, IsEmptyWhileHiddenAndAfterTheEnd) {
  Driver driver;
  rest_at(driver, 4);
  driver.say(protocol::VisibilityMessage{true});
  ASSERT_EQ(driver.requests.size(), 1U);
  EXPECT_THAT(driver.requests[0].steps, IsEmpty());
  driver.say(protocol::VisibilityMessage{false});
  ASSERT_EQ(driver.requests.size(), 2U);
  EXPECT_THAT(driver.requests[1].steps, ElementsAre(5, 3));
  driver.drain();
  ASSERT_EQ(driver.requests.size(), 3U);
  EXPECT_THAT(driver.requests[2].steps, IsEmpty());
  EXPECT_TRUE(driver.closed);
}

TEST(PrefetchRequest, IsWithdrawnWithTheDataset) {
  Driver driver;
  rest_at(driver, 4);
  driver.say(protocol::OpenMessage{3, "sea"});
  ASSERT_EQ(driver.requests.size(), 1U);
  EXPECT_THAT(driver.requests[0].steps, IsEmpty());
  driver.described(3, protocol::DatasetDescription{});
  driver.settle();
  EXPECT_THAT(driver.requests.back().steps, ElementsAre(1));
  EXPECT_EQ(driver.requests.back().view.dataset, "sea");
}

// At most sixteen: tested with the player itself, with more steps than the driver's datasets have.
TEST(PrefetchRequest, CoversSixteenStepsAhead) {
  Player player;
  player.start(play(0, 239, 24, true, true), 230, 0);
  auto wanted = iota(231, 9);
  const auto wrapped = iota(0, 7);
  wanted.insert(wanted.end(), wrapped.begin(), wrapped.end());
  EXPECT_EQ(player.upcoming(16), wanted);
  player.start(play(239, 0, 24, false, true), 230, 0);
  EXPECT_EQ(player.upcoming(3), (std::vector<int>{229, 228, 227}));
}

}  // namespace
}  // namespace session_test
