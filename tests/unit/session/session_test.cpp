// Responses of a session: opening, rejected patches, playback, closing.
#include <gmock/gmock.h>

#include "driver.hpp"

namespace session_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

protocol::DatasetDescription description(const std::string& id) {
  protocol::DatasetDescription out;
  out.id = id;
  return out;
}

// --- opening ------------------------------------------------------------------------------------

TEST(Open, DescribesTheDatasetAndRendersIt) {
  Driver driver;
  driver.say(protocol::OpenMessage{5, "wind"});
  ASSERT_EQ(driver.describes.size(), 1U);
  EXPECT_EQ(driver.describes[0].dataset, "wind");
  EXPECT_FALSE(driver.render) << "the client may still send a view";
  driver.patch(1, R"({"image":{"width":640,"height":480}})");
  driver.described(5, description("wind"));
  const auto opened = driver.texts_of<protocol::OpenedMessage>();
  ASSERT_EQ(opened.size(), 1U);
  EXPECT_EQ(opened[0].id, 5U);
  EXPECT_EQ(opened[0].dataset.id, "wind");
  ASSERT_TRUE(driver.render);
  EXPECT_EQ(driver.render->view.dataset, "wind");
  EXPECT_EQ(driver.render->view.image.width, 640);
}

// If several requests are refused, a client may show only the last error.
TEST(Open, FailureExplainsWhyThereIsNothingToPlay) {
  const auto why = make_error(ErrorKind::out_of_memory, "the field needs 9 MiB");
  const auto play = [](Driver& driver) {
    driver.texts.clear();
    driver.say(protocol::PlayMessage{});
    return driver.texts_of<protocol::ErrorMessage>().at(0).problem;
  };
  Driver described;
  EXPECT_EQ(play(described).status, 404) << "nothing was requested";
  described.say(protocol::OpenMessage{5, "wind"});
  described.described(5, why);
  EXPECT_EQ(play(described).status, 507);
  EXPECT_THAT(play(described).detail, HasSubstr("no dataset is open: the field needs 9 MiB"));
  Driver drawn;
  drawn.patch(1, R"({"dataset":"wind"})");
  drawn.fail_render(why);
  EXPECT_EQ(play(drawn).status, 507);

  // After another dataset was opened, an earlier failure is no longer reported.
  described.say(protocol::OpenMessage{6, "sea"});
  described.described(6, description("sea"));
  described.patch(1, R"({"dataset":null})");
  EXPECT_EQ(play(described).status, 404);
  drawn.patch(2, R"({"dataset":"sea"})");
  drawn.finish_render();
  drawn.patch(3, R"({"dataset":null})");
  EXPECT_EQ(play(drawn).status, 404);
}

// Progress is not reported for fast loads, nor for reads of other sessions while this one renders.
TEST(Open, LoadingProgressIsReportedWhileAFrameWaits) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.reading = Reading{"u", 0.25};
  driver.wait(250 * ms);
  EXPECT_TRUE(driver.texts_of<protocol::ProgressMessage>().empty());
  driver.wait(100 * ms);
  driver.reading->done = 0.75;
  driver.wait(250 * ms);
  driver.reading.reset();
  driver.wait(1000 * ms);
  const auto told = driver.texts_of<protocol::ProgressMessage>();
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].phase, "loading u");
  EXPECT_EQ(told[0].done, 0.25);
  EXPECT_EQ(told[1].done, 0.75);
  EXPECT_FALSE(told[0].id);
  driver.settle();
  driver.texts.clear();
  driver.reading = Reading{"u", 0.5};
  driver.wait(2000 * ms);
  for (int n = 0; n < 20; ++n) {
    driver.patch(2 + n, R"({"camera":{"eye":[0,0,)" + std::to_string(3 + n) + "]}}");
    driver.finish_render(100 * ms);
    driver.ack(driver.frames.back().header.seq);
  }
  EXPECT_TRUE(driver.texts_of<protocol::ProgressMessage>().empty());
}

// --- files that change --------------------------------------------------------------------------

TEST(Changed, DatasetIsDescribedAndRenderedAgain) {
  Driver driver;
  driver.say(protocol::OpenMessage{5, "wind"});
  driver.described(5, description("wind"));
  driver.settle();
  const int before = driver.renders;
  driver.describes.clear();
  driver.texts.clear();
  driver.changed("sea");
  EXPECT_TRUE(driver.describes.empty()) << "is not shown";
  driver.changed("wind");
  ASSERT_EQ(driver.describes.size(), 1U);
  EXPECT_EQ(driver.describes[0].id, 5U);
  driver.changed("wind");
  EXPECT_EQ(driver.describes.size(), 1U) << "is being opened";
  driver.described(5, description("wind"));
  EXPECT_EQ(driver.texts_of<protocol::OpenedMessage>().size(), 1U);
  driver.settle();
  EXPECT_GT(driver.renders, before);
}

TEST(Changed, MissingStepBecomesTheLastAndNeighborsArePrefetched) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","step":8})");
  driver.settle();
  driver.step_count = 4;
  driver.changed("wind");
  ASSERT_TRUE(driver.render);
  EXPECT_EQ(driver.render->view.step, 3);
  driver.settle();
  EXPECT_TRUE(driver.errors().empty());
  driver.requests.clear();
  driver.changed("wind");
  driver.settle();
  ASSERT_FALSE(driver.requests.empty());
  EXPECT_THAT(driver.requests.back().steps, ElementsAre(2));
}

TEST(Open, UnknownDatasetIsAnErrorAndTheViewStays) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.say(protocol::OpenMessage{9, "nowhere"});
  const auto errors = driver.errors();
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_EQ(errors[0].id, 9U);
  EXPECT_EQ(errors[0].problem.status, 404);
  EXPECT_TRUE(driver.describes.empty());
  driver.patch(2, R"({"step":1})");
  ASSERT_TRUE(driver.render);
  EXPECT_EQ(driver.render->view.dataset, "wind");
}

TEST(Open, AnotherDatasetResetsTheViewExceptThePictureSize) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","step":4,"image":{"width":640,"height":480},
                      "vector":{"field":"u"}})");
  driver.settle();
  driver.say(protocol::OpenMessage{1, "sea"});
  driver.described(1, description("sea"));
  ASSERT_TRUE(driver.render);
  const View& view = driver.render->view;
  EXPECT_EQ(view.dataset, "sea");
  EXPECT_EQ(view.step, 0);
  EXPECT_EQ(view.image.width, 640);
  EXPECT_EQ(view.vector.field.kind, protocol::FieldChoice::Kind::dataset_default);
}

TEST(Open, UnreadableDataKeepTheOldView) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","step":2})");
  driver.settle();
  driver.say(protocol::OpenMessage{3, "sea"});
  driver.described(3, make_error(ErrorKind::bad_data, "the file is damaged"));
  ASSERT_EQ(driver.errors().size(), 1U);
  EXPECT_EQ(driver.errors()[0].id, 3U);
  driver.settle();
  EXPECT_EQ(driver.frames.back().header.step, 2U);
}

// --- patches ------------------------------------------------------------------------------------

TEST(Patch, InvalidPatchNamesRevAndPointerAndKeepsTheView) {
  for (const char* bad :
       {R"({"image":{"width":0}})", R"({"unknown":1})", R"({"step":-1})", R"({"step":99})",
        R"({"camera":{"fovY":1e999}})", R"({"dataset":"nowhere"})", R"([1])"}) {
    Driver driver;
    driver.patch(1, R"({"dataset":"wind","step":2})");
    driver.settle();
    const int renders = driver.renders;
    driver.patch(2, bad);
    ASSERT_EQ(driver.errors().size(), 1U) << bad;
    const auto error = driver.errors()[0];
    EXPECT_EQ(error.rev, 2U) << bad;
    EXPECT_FALSE(error.id) << bad;
    EXPECT_GE(error.problem.status, 400) << bad;
    driver.wait(1000 * ms);
    EXPECT_EQ(driver.renders, renders) << bad;
    driver.patch(3, R"({"camera":{"fovY":20}})");
    ASSERT_TRUE(driver.render) << bad;
    EXPECT_EQ(driver.render->view.step, 2) << bad;
    EXPECT_EQ(driver.render->view.dataset, "wind") << bad;
  }
}

TEST(Patch, BeforeADatasetIsOpenIsRemembered) {
  Driver driver;
  driver.patch(1, R"({"image":{"width":320,"height":200}})");
  EXPECT_FALSE(driver.render);
  EXPECT_TRUE(driver.errors().empty());
  driver.patch(2, R"({"dataset":"wind"})");
  ASSERT_TRUE(driver.render);
  EXPECT_EQ(driver.render->view.image.width, 320);
}

TEST(Patch, UnreadableDataDiscardThatPatchOnly) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","step":2})");
  driver.settle();
  driver.patch(2, R"({"step":3})");
  driver.patch(3, R"({"camera":{"fovY":20}})");
  driver.fail_render(make_error(ErrorKind::bad_data, "step 3 is damaged"));
  ASSERT_EQ(driver.errors().size(), 1U);
  EXPECT_EQ(driver.errors()[0].rev, 2U);
  EXPECT_THAT(driver.errors()[0].problem.detail, HasSubstr("damaged"));
  driver.settle();
  EXPECT_EQ(driver.frames.back().header.step, 2U);
  EXPECT_EQ(driver.frames.back().header.rev, 3U);
}

// A later patch hides the unreadable step before any frame of it is drawn.
TEST(Patch, FailedPatchBelowLaterOnesIsFoundAndTheStreamContinues) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","step":2})");
  driver.settle();
  driver.patch(2, R"({"camera":{"fovY":30}})");
  driver.patch(3, R"({"step":3})");
  driver.patch(4, R"({"camera":{"fovY":20}})");
  driver.finish_render();
  const auto fail_step_3 = [&] {
    for (int turns = 0; turns < 10 && driver.render && driver.render->view.step == 3; ++turns) {
      driver.fail_render(make_error(ErrorKind::bad_data, "step 3 is damaged"));
    }
  };
  fail_step_3();
  driver.settle();
  EXPECT_EQ(driver.frames.back().header.step, 2U) << "what was drawn before";
  driver.patch(5, R"({"camera":{"fovY":25}})");
  fail_step_3();
  driver.settle();
  EXPECT_EQ(driver.frames.back().header.rev, 5U) << "a valid patch is applied";
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  bool named = false;
  for (const auto& error : driver.errors()) {
    named = named || error.rev == 3U;
    EXPECT_NE(error.rev, 5U);
  }
  EXPECT_TRUE(named) << "the rejected patch is named";
}

TEST(Patch, PermanentFailureIsNotRetried) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.finish_render();
  driver.ack(1);
  driver.patch(2, R"({"step":5})");
  driver.fail_render(make_error(ErrorKind::out_of_memory, "no room"));
  ASSERT_TRUE(driver.render) << "the old view again, of which no final frame was sent";
  driver.fail_render(make_error(ErrorKind::out_of_memory, "no room"));
  const int renders = driver.renders;
  driver.wait(3000 * ms);
  EXPECT_EQ(driver.renders, renders);
  EXPECT_EQ(driver.errors().size(), 2U);
}

TEST(Patch, FailureKeepsTheFinalFrame) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  const int renders = driver.renders;
  driver.patch(2, R"({"step":5})");
  driver.fail_render(make_error(ErrorKind::out_of_memory, "no room"));
  driver.wait(3000 * ms);
  EXPECT_EQ(driver.renders, renders + 1) << "the client displays the final frame of the old view";
  ASSERT_EQ(driver.errors().size(), 1U);
  EXPECT_EQ(driver.errors()[0].rev, 2U);
  EXPECT_TRUE(driver.texts_of<protocol::UnchangedMessage>().empty()) << "no patch is answered";
}

// --- acknowledgements ---------------------------------------------------------------------------

TEST(Ack, OfAnUnsentFrameIsAnErrorAndGivesNoCredit) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.ack(1);
  driver.finish_render();
  driver.patch(2, R"({"step":1})");
  driver.finish_render();
  driver.ack(3);
  driver.ack(4294967295U);
  EXPECT_EQ(driver.errors().size(), 3U);
  EXPECT_EQ(driver.errors()[0].problem.errors.at(0).pointer, "/seq");
  driver.patch(3, R"({"step":2})");
  EXPECT_FALSE(driver.render) << "no credit was gained";
  EXPECT_FALSE(driver.closed);
  driver.ack(1);
  EXPECT_TRUE(driver.render);
}

TEST(Ack, MayBeRepeatedOrLate) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.finish_render();
  driver.patch(2, R"({"step":1})");
  driver.finish_render();
  driver.ack(2);
  driver.ack(2);
  driver.ack(1);
  EXPECT_TRUE(driver.errors().empty());
  driver.patch(3, R"({"step":2})");
  driver.finish_render();
  driver.patch(4, R"({"step":3})");
  driver.finish_render();
  driver.patch(5, R"({"step":4})");
  EXPECT_FALSE(driver.render) << "two are unacknowledged, however often old ones were acknowledged";
}

// --- playback -----------------------------------------------------------------------------------

// Draws each frame in `cost` and acknowledges it, for `duration`.
void run_for(Driver& driver, Micros duration, Micros cost) {
  const Micros end = driver.now() + duration;
  while (driver.now() < end) {
    if (driver.render) {
      driver.finish_render(cost);
      driver.ack(driver.frames.back().header.seq);
    } else {
      driver.wait(5 * ms);
    }
  }
}

TEST(Play, ShowsEveryStepInTimeWhenPossible) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.frames.clear();
  driver.say(play(0, 3, 10, true, true));
  run_for(driver, 850 * ms, 20 * ms);
  EXPECT_THAT(driver.steps_shown(), ElementsAre(1U, 2U, 3U, 0U, 1U, 2U, 3U, 0U));
}

TEST(Play, WithDropSkipsLateSteps) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.frames.clear();
  driver.say(play(0, 9, 20, false, true));
  run_for(driver, 700 * ms, 120 * ms);  // 50 ms per step, 120 ms per frame
  std::vector<std::uint32_t> shown;
  for (const SendFrame& frame : driver.frames) {
    if (!Driver::is_final(frame)) shown.push_back(frame.header.step);
  }
  ASSERT_GE(shown.size(), 3U);
  for (std::size_t n = 1; n < shown.size(); ++n) EXPECT_GT(shown[n], shown[n - 1]);
  EXPECT_LT(shown.size(), 7U) << "some must be skipped";
  EXPECT_EQ(shown.back(), 9U) << "the last step is the end of the range, and on time";
}

TEST(Play, WithoutDropShowsEveryStep) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.frames.clear();
  driver.say(play(0, 5, 20, false, false));
  run_for(driver, 900 * ms, 120 * ms);
  driver.settle();
  std::vector<std::uint32_t> moving;
  for (const SendFrame& frame : driver.frames) {
    if (!Driver::is_final(frame)) moving.push_back(frame.header.step);
  }
  EXPECT_THAT(moving, ElementsAre(1U, 2U, 3U, 4U, 5U));
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
}

TEST(Play, PauseStopsAtTheShownStepAndMakesItFinal) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.say(play(0, 9, 10, true, true));
  run_for(driver, 350 * ms, 10 * ms);
  driver.say(protocol::PauseMessage{});
  driver.frames.clear();
  driver.settle();
  EXPECT_THAT(driver.steps_shown(), ElementsAre(3U));
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  driver.patch(2, R"({"camera":{"fovY":20}})");
  ASSERT_TRUE(driver.render);
  EXPECT_EQ(driver.render->view.step, 3) << "the view keeps the step reached by the clock";
}

TEST(Play, ContinuesFromASelectedStep) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.say(play(0, 9, 10, true, true));
  driver.patch(2, R"({"step":7})");
  driver.frames.clear();
  run_for(driver, 250 * ms, 5 * ms);
  EXPECT_THAT(driver.steps_shown(), ElementsAre(7U, 8U, 9U));
}

TEST(Play, InvalidStepOrMissingDatasetIsAnError) {
  Driver driver;
  driver.say(play(0, 3, 10, true, true));
  driver.patch(1, R"({"dataset":"wind"})");
  driver.say(play(0, steps, 10, true, true));
  ASSERT_EQ(driver.errors().size(), 2U);
  EXPECT_EQ(driver.errors()[1].problem.errors.at(0).pointer, "/to");
}

TEST(Play, UnreadableStepStopsIt) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.say(play(0, 9, 10, true, true));
  driver.wait(110 * ms);
  driver.fail_render(make_error(ErrorKind::bad_data, "damaged"));
  driver.settle();
  driver.wait(1000 * ms);
  EXPECT_EQ(driver.errors().size(), 1U);
  EXPECT_EQ(driver.frames.back().header.step, 0U);
}

// --- closing ------------------------------------------------------------------------------------

TEST(End, BinaryMessageClosesWith4400) {
  Driver driver;
  driver.binary();
  ASSERT_TRUE(driver.closed);
  EXPECT_EQ(driver.closed->code, 4400);
}

TEST(End, DrainClosesWith1001AndCancelsTheRender) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.drain();
  ASSERT_TRUE(driver.closed);
  EXPECT_EQ(driver.closed->code, 1001);
  EXPECT_TRUE(driver.cancelled);
  driver.patch(2, R"({"step":1})");
  driver.finish_render();
  EXPECT_TRUE(driver.frames.empty());
}

TEST(End, SilenceClosesWith4410AndAnyMessageKeepsItOpen) {
  Options options;
  options.idle_timeout_us = 60'000 * ms;
  Driver driver(options);
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.wait(50'000 * ms);
  driver.ack(1);
  driver.wait(50'000 * ms);
  driver.refused(make_error(ErrorKind::malformed, "no JSON"));
  driver.wait(59'000 * ms);
  EXPECT_FALSE(driver.closed);
  driver.wait(2'000 * ms);
  ASSERT_TRUE(driver.closed);
  EXPECT_EQ(driver.closed->code, 4410);
}

TEST(End, InvalidMessageIsAnsweredWithoutOtherEffects) {
  Driver driver;
  driver.refused(make_error(ErrorKind::malformed, "no JSON"));
  ASSERT_EQ(driver.errors().size(), 1U);
  EXPECT_EQ(driver.errors()[0].problem.status, 400);
  EXPECT_FALSE(driver.closed);
}

}  // namespace
}  // namespace session_test
