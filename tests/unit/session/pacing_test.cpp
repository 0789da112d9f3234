// Which frames are sent and when: credit, newest view first, unchanged pictures.
#include <gmock/gmock.h>

#include "driver.hpp"

namespace session_test {
namespace {

using testing::ElementsAre;

TEST(Pacing, SinglePatchGivesAMovingAndThenTheFinalFrame) {
  Driver driver;
  driver.patch(7, R"({"dataset":"wind"})", 123.5);
  driver.finish_render();
  ASSERT_EQ(driver.frames.size(), 1U);
  const auto moving = driver.frames[0].header;
  EXPECT_EQ(moving.seq, 1U);
  EXPECT_EQ(moving.rev, 7U);
  EXPECT_EQ(moving.t, 123.5);
  EXPECT_FALSE(Driver::is_final(driver.frames[0]));
  EXPECT_EQ(moving.codec, protocol::Codec::jpeg);

  driver.ack(1);
  driver.wait(100 * ms);
  EXPECT_FALSE(driver.render) << "too early: motion may continue";
  driver.wait(60 * ms);
  ASSERT_TRUE(driver.render);
  EXPECT_EQ(driver.render->setting.half_level, 0);
  EXPECT_TRUE(driver.render->encoding.full_chroma);
  driver.finish_render();
  ASSERT_EQ(driver.frames.size(), 2U);
  EXPECT_TRUE(Driver::is_final(driver.frames[1]));
  EXPECT_EQ(driver.frames[1].header.rev, 7U);
  EXPECT_GT(driver.frames[1].header.quality, moving.quality);

  driver.ack(2);
  driver.wait(5000 * ms);
  EXPECT_FALSE(driver.render) << "nothing is left to render";
}

TEST(Pacing, MovingFramesDoNotWaitForDataAndFramesAtRestDo) {
  Driver driver;
  driver.missing_bytes = 1000;
  for (std::uint32_t rev = 1; rev <= 3; ++rev) {
    driver.patch(rev, rev == 1 ? R"({"dataset":"wind"})" : azimuth(static_cast<int>(rev)));
    ASSERT_TRUE(driver.render);
    EXPECT_TRUE(driver.render->may_stand_in);
    driver.finish_render();
    driver.ack(rev);
    EXPECT_FALSE(Driver::is_final(driver.frames.back()));
  }
  driver.say(protocol::StillMessage{5, {}, {}, "png"});
  ASSERT_TRUE(driver.render);
  EXPECT_FALSE(driver.render->may_stand_in) << "a still shows what is wanted";
  driver.finish_render();
  driver.wait(200 * ms);
  ASSERT_TRUE(driver.render);
  EXPECT_FALSE(driver.render->may_stand_in);
  driver.finish_render(3000 * ms, true);
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  EXPECT_EQ(driver.frames.back().header.rev, 3U);
  driver.ack(driver.frames.back().header.seq);
  driver.wait(5000 * ms);
  EXPECT_FALSE(driver.render) << "the final frame is the last";
}

TEST(Pacing, FramesOfPlaybackWaitForTheirData) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.say(play(0, 5, 5, true, false));
  driver.wait(300 * ms);
  ASSERT_TRUE(driver.render);
  EXPECT_FALSE(driver.render->encoding.full_chroma);
  EXPECT_FALSE(driver.render->may_stand_in);
}

TEST(Pacing, MovingFramesUseKernelsAndFinalOnesTheRequestedMethod) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  ASSERT_TRUE(driver.render);
  EXPECT_EQ(driver.render->setting.method, protocol::MethodName::kernel);
  driver.finish_render(500 * ms);
  driver.ack(1);
  driver.wait(200 * ms);
  ASSERT_TRUE(driver.render);
  EXPECT_EQ(driver.render->setting.method, protocol::MethodName::slab);
}

TEST(Pacing, SlowFinalSlabFramesDoNotCoarsenMovingOnes) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  ASSERT_TRUE(driver.render);
  const quality::Setting before = driver.render->setting;
  driver.finish_render(10 * ms);
  driver.ack(1);
  driver.wait(200 * ms);
  ASSERT_TRUE(driver.render);
  driver.finish_render(3000 * ms);
  driver.ack(2);
  driver.patch(2, azimuth(1));
  ASSERT_TRUE(driver.render);
  EXPECT_LE(driver.render->setting.half_level, before.half_level);
  EXPECT_LE(driver.render->setting.coarser, before.coarser);
}

TEST(Pacing, EveryFrameIsAnnouncedWithItsSetting) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  const auto chosen = driver.texts_of<protocol::ChosenMessage>();
  ASSERT_EQ(chosen.size(), driver.frames.size());
  for (std::size_t n = 0; n < chosen.size(); ++n) {
    EXPECT_EQ(chosen[n].seq, driver.frames[n].header.seq);
    EXPECT_EQ(chosen[n].info.width, driver.frames[n].header.width);
  }
}

TEST(Pacing, LosslessViewRestsAsPngAndMovesAsJpeg) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","quality":{"lossless":true}})");
  driver.settle();
  ASSERT_EQ(driver.frames.size(), 2U);
  EXPECT_EQ(driver.frames[0].header.codec, protocol::Codec::jpeg);
  EXPECT_EQ(driver.frames[1].header.codec, protocol::Codec::png);
  EXPECT_EQ(driver.frames[1].header.quality, 100);
  EXPECT_TRUE(Driver::is_final(driver.frames[1]));
}

TEST(Pacing, FinalFrameHasHighQualityOnAnyLink) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.finish_render();
  driver.ack(1);
  for (std::uint32_t rev = 2; rev < 12; ++rev) {
    driver.patch(rev, azimuth(static_cast<int>(rev)));
    driver.finish_render();
    driver.wait(100 * ms);  // insufficient even for 1 kB
    driver.ack(rev);
  }
  EXPECT_EQ(driver.frames.back().header.quality, 40);
  EXPECT_GT(driver.frames.back().header.level, 0);
  driver.settle();
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  EXPECT_GE(driver.frames.back().header.quality, 90);
  EXPECT_EQ(driver.frames.back().header.level, 0);
}

TEST(Pacing, NoThirdFrameBeforeAnAcknowledgement) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.finish_render();
  driver.patch(2, azimuth(1));
  driver.finish_render();
  for (int n = 3; n < 20; ++n) {
    driver.patch(static_cast<std::uint32_t>(n), azimuth(n));
    driver.wait(50 * ms);
  }
  EXPECT_EQ(driver.frames.size(), 2U);
  EXPECT_FALSE(driver.render) << "a frame without credit would be outdated when sent";

  driver.ack(2);  // acknowledges frame 1 too
  driver.finish_render();
  EXPECT_EQ(driver.frames.size(), 3U);
  EXPECT_EQ(driver.frames[2].header.rev, 19U) << "the newest view, not the next one";
}

TEST(Pacing, NothingIsRenderedWhileAFrameIsWritten) {
  Driver driver;
  driver.write_at_once = false;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.finish_render();
  driver.ack(1);
  driver.patch(2, azimuth(1));
  driver.patch(3, azimuth(2));
  EXPECT_FALSE(driver.render);
  driver.written();
  ASSERT_TRUE(driver.render);
  driver.finish_render();
  EXPECT_EQ(driver.frames.back().header.rev, 3U);
}

TEST(Pacing, SteadyPatchesStarveNoSession) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  const std::size_t before = driver.frames.size();
  std::uint32_t rev = 1;
  // A hundred patches per second for two seconds; a frame takes 35 ms and is acknowledged at once.
  Micros busy = 0;
  for (int n = 0; n < 200; ++n) {
    driver.patch(++rev, azimuth(n));
    if (driver.render) {
      busy += 10 * ms;
      EXPECT_FALSE(driver.cancelled && !driver.render->encoding.full_chroma)
          << "moving frames are completed";
    }
    driver.wait(10 * ms);
    if (busy >= 30 * ms) {
      busy = 0;
      driver.finish_render(5 * ms);
      driver.ack(driver.frames.back().header.seq);
    }
  }
  const std::size_t moved = driver.frames.size() - before;
  EXPECT_GE(moved, 40U) << "about one per render time";
  for (std::size_t n = before + 1; n < driver.frames.size(); ++n) {
    EXPECT_GT(driver.frames[n].header.rev, driver.frames[n - 1].header.rev);
    EXPECT_FALSE(Driver::is_final(driver.frames[n]));
  }
  EXPECT_GE(driver.frames.back().header.rev + 10, rev) << "never far behind";
}

TEST(Pacing, AfterStoppingOnlyTheNewestViewIsShown) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.patch(2, azimuth(1));
  for (std::uint32_t rev = 3; rev <= 30; ++rev) driver.patch(rev, azimuth(static_cast<int>(rev)));
  const std::size_t before = driver.frames.size();
  driver.settle();
  std::vector<std::uint32_t> revs;
  for (std::size_t n = before; n < driver.frames.size(); ++n) {
    revs.push_back(driver.frames[n].header.rev);
  }
  // The frame that was running at the start, the newest in motion, and the final one.
  EXPECT_THAT(revs, ElementsAre(2U, 30U, 30U));
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
}

TEST(Pacing, ChangeCancelsTheFinalFrameForAMovingOne) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.finish_render();
  driver.ack(1);
  driver.wait(200 * ms);
  ASSERT_TRUE(driver.render && driver.render->encoding.full_chroma);
  driver.patch(2, azimuth(1));
  EXPECT_TRUE(driver.cancelled);
  driver.finish_render(1 * ms);
  EXPECT_EQ(driver.frames.size(), 1U) << "a cancelled frame is not sent";
  ASSERT_TRUE(driver.render);
  EXPECT_FALSE(driver.render->encoding.full_chroma);
  driver.finish_render();
  EXPECT_EQ(driver.frames.back().header.rev, 2U);
}

TEST(Pacing, FinalFrameFinishedJustBeforeAChangeIsDropped) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.finish_render();
  driver.ack(1);
  driver.wait(200 * ms);
  ASSERT_TRUE(driver.render);
  driver.patch(2, azimuth(1));
  driver.cancelled = false;  // it finished before the cancellation
  driver.finish_render(1 * ms);
  EXPECT_EQ(driver.frames.size(), 1U);
  driver.settle();
  EXPECT_EQ(driver.texts_of<protocol::StatsMessage>().back().dropped, 1U);
}

TEST(Pacing, HiddenClientGetsNothingUntilVisible) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  EXPECT_EQ(driver.hides, 0);
  driver.say(protocol::VisibilityMessage{true});
  EXPECT_TRUE(driver.cancelled);
  EXPECT_EQ(driver.hides, 1) << "its data need not be loaded";
  driver.finish_render(1 * ms);
  driver.patch(2, azimuth(1));
  driver.wait(2000 * ms);
  EXPECT_FALSE(driver.render);
  EXPECT_TRUE(driver.frames.empty());
  driver.say(protocol::VisibilityMessage{false});
  driver.settle();
  EXPECT_EQ(driver.frames.back().header.rev, 2U);
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
}

// --- unchanged pictures --------------------------------------------------------------------------

using Revs = std::vector<std::uint32_t>;

Revs unchanged_revs(const Driver& driver) {
  Revs revs;
  for (const auto& message : driver.texts_of<protocol::UnchangedMessage>()) {
    revs.push_back(message.rev);
  }
  return revs;
}

TEST(Unchanged, EquivalentPatchIsAnsweredWithoutAFrame) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","camera":{"eye":[1,2,3]}})");
  driver.settle();
  const std::size_t frames = driver.frames.size();
  const int renders = driver.renders;
  driver.patch(2, R"({"camera":{"eye":[1,2,3]}})");
  driver.patch(3, R"({"step":0})");  // its default, stated explicitly
  driver.patch(4, "{}");
  EXPECT_EQ(unchanged_revs(driver), (Revs{2, 3, 4}));
  EXPECT_EQ(driver.texts_of<protocol::UnchangedMessage>().back().seq,
            driver.frames.back().header.seq);
  driver.wait(3000 * ms);
  EXPECT_EQ(driver.frames.size(), frames);
  EXPECT_EQ(driver.renders, renders);

  driver.patch(5, azimuth(2));
  driver.settle();
  EXPECT_EQ(driver.frames.back().header.rev, 5U) << "the next change is visible";
  EXPECT_EQ(unchanged_revs(driver), (Revs{2, 3, 4}));
}

TEST(Unchanged, AnyDifferenceIsRendered) {
  for (const char* other :
       {R"({"step":1})", R"({"camera":{"eye":[1,2,4]}})", R"({"image":{"background":"#010101"}})",
        R"({"image":{"width":99}})", R"({"vector":{"field":null}})", R"({"dataset":"sea"})"}) {
    Driver driver;
    driver.patch(1, R"({"dataset":"wind","camera":{"eye":[1,2,3]}})");
    driver.settle();
    driver.patch(2, other);
    EXPECT_TRUE(driver.render) << other;
    EXPECT_TRUE(unchanged_revs(driver).empty()) << other;
  }
}

TEST(Unchanged, MovingFrameDoesNotStandForItsView) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.finish_render();
  driver.ack(1);
  driver.patch(2, "{}");
  EXPECT_TRUE(unchanged_revs(driver).empty());
  driver.settle();
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  EXPECT_EQ(driver.frames.back().header.rev, 2U);
}

TEST(Unchanged, ReturnToTheShownViewDuringARenderIsRenderedAgain) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.patch(2, azimuth(1));
  ASSERT_TRUE(driver.render);
  driver.patch(3, R"({"camera":{"eye":null}})");
  EXPECT_TRUE(unchanged_revs(driver).empty()) << "the frame of rev 2 is still pending";
  driver.settle();
  EXPECT_EQ(driver.frames.back().header.rev, 3U);
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
}

TEST(Unchanged, ThereAndBackWithoutCreditNeedsNoFrame) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.finish_render();
  driver.wait(200 * ms);
  ASSERT_TRUE(driver.render);
  driver.finish_render();  // the final one: two frames, neither acknowledged
  ASSERT_TRUE(Driver::is_final(driver.frames.back()));
  driver.patch(2, azimuth(1));
  EXPECT_FALSE(driver.render);
  driver.patch(3, R"({"camera":{"eye":null}})");
  EXPECT_EQ(unchanged_revs(driver), (Revs{3}));
  driver.ack(2);
  driver.wait(3000 * ms);
  EXPECT_EQ(driver.frames.size(), 2U);
}

TEST(Unchanged, CameraMotionWithoutVisibleContentSendsNothing) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","camera":{"eye":[2000,0,0]}})");
  driver.settle();
  const std::size_t frames = driver.frames.size();
  for (std::uint32_t rev = 2; rev < 6; ++rev) {
    driver.patch(rev, azimuth(2000 + static_cast<int>(rev)));
    driver.settle();
  }
  EXPECT_EQ(driver.frames.size(), frames);
  EXPECT_EQ(unchanged_revs(driver), (Revs{2, 3, 4, 5}));
  driver.patch(6, azimuth(3));
  driver.settle();
  EXPECT_EQ(driver.frames.back().header.rev, 6U) << "content is visible again";
  EXPECT_GT(driver.frames.size(), frames);
}

TEST(Unchanged, EmptyMovingFrameDoesNotStandForTheFinalOne) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","camera":{"eye":[2000,0,0]}})");
  driver.settle(200 * ms);
  const std::size_t frames = driver.frames.size();
  driver.patch(2, azimuth(600));
  ASSERT_TRUE(driver.render);
  EXPECT_FALSE(driver.render->encoding.full_chroma) << "a moving frame is sent first";
  driver.finish_render(10 * ms);
  EXPECT_EQ(driver.frames.size(), frames);
  EXPECT_TRUE(unchanged_revs(driver).empty()) << "not yet known";
  driver.settle(200 * ms);
  ASSERT_EQ(driver.frames.size(), frames + 1);
  EXPECT_EQ(driver.frames.back().header.rev, 2U);
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  EXPECT_TRUE(unchanged_revs(driver).empty());
}

TEST(Unchanged, RepeatedRevIsAnsweredAgain) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  const std::size_t frames = driver.frames.size();
  driver.patch(1, "{}");
  driver.patch(1, R"({"dataset":"wind"})");
  EXPECT_EQ(unchanged_revs(driver), (Revs{1, 1}));
  driver.patch(1, azimuth(1));
  driver.settle();
  EXPECT_GT(driver.frames.size(), frames);
  EXPECT_EQ(unchanged_revs(driver), (Revs{1, 1})) << "this one is answered by frames";
  driver.wait(3000 * ms);
  EXPECT_EQ(unchanged_revs(driver), (Revs{1, 1})) << "without a patch there is no response";
}

TEST(Unchanged, ReturnAfterARefusalAnswersOpenPatchesOnly) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.patch(2, azimuth(1));
  driver.fail_render(make_error(ErrorKind::bad_data, ""));
  driver.settle();
  ASSERT_EQ(driver.errors().size(), 1U);
  EXPECT_EQ(driver.errors()[0].rev, 2U);
  EXPECT_TRUE(unchanged_revs(driver).empty()) << "rev 1 was already answered";
}

TEST(Unchanged, EmptyViewDifferingInMoreThanTheCameraIsSent) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind","camera":{"eye":[2000,0,0]}})");
  driver.settle();
  const std::size_t frames = driver.frames.size();
  driver.patch(2, R"({"image":{"background":"#ffffff"}})");
  driver.settle();
  EXPECT_GT(driver.frames.size(), frames);
  EXPECT_EQ(driver.frames.back().header.rev, 2U);
}

TEST(Unchanged, ChangeToAnEmptyPictureIsSent) {
  Driver driver;
  driver.patch(1, R"({"dataset":"wind"})");
  driver.settle();
  driver.patch(2, azimuth(2000));
  driver.settle();
  EXPECT_EQ(driver.frames.back().header.rev, 2U);
  EXPECT_TRUE(Driver::is_final(driver.frames.back()));
  EXPECT_TRUE(unchanged_revs(driver).empty());
}

}  // namespace
}  // namespace session_test
