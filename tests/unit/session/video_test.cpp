// When moving frames are H.264, and which of them are key frames.
#include <gtest/gtest.h>

#include "driver.hpp"
#include "server/session/pacing/video_choice.hpp"

namespace session_test {
namespace {

using protocol::Codec;

constexpr Micros budget = 33 * ms;
const std::vector<std::string> high{"vp09.00.10.08", "avc1.640033"};

VideoChoice announced() {
  VideoChoice video(true);
  video.announced(high);
  return video;
}

// Frames until the choice changes from `before`, at most 100.
int frames_until_change(VideoChoice& video, Micros low, Micros good) {
  const bool before = video.on();
  for (int n = 1; n <= 100; ++n) {
    if (video.choose(low, good, budget, 0) != before) return n;
  }
  return 0;
}

TEST(VideoChoice, BeginsOnASlowLinkAndEndsOnAFastOneAfterAFewFrames) {
  VideoChoice video = announced();
  EXPECT_EQ(frames_until_change(video, budget - 1, budget), 0);
  EXPECT_EQ(frames_until_change(video, budget + 1, 2 * budget), VideoChoice::frames_to_begin);
  EXPECT_EQ(frames_until_change(video, budget / 3, budget / 2), 0) << "between the two limits";
  EXPECT_EQ(frames_until_change(video, budget / 4, budget / 2 - 1), VideoChoice::frames_to_end);
  EXPECT_FALSE(video.on());
}

TEST(VideoChoice, OneFrameBetweenDoesNotChangeIt) {
  VideoChoice video = announced();
  for (int n = 0; n < 50; ++n) {
    const bool slow = n % VideoChoice::frames_to_begin != 0;
    EXPECT_FALSE(video.choose(slow ? 2 * budget : budget / 2, budget, budget, 0));
  }
}

TEST(VideoChoice, NeedsAnAnnouncementOfTheHighProfileAndAnEncoder) {
  VideoChoice unable(false);
  unable.announced(high);
  EXPECT_EQ(frames_until_change(unable, 2 * budget, 2 * budget), 0);
  for (const char* other : {"avc1.42E033", "avc1.6400", "avc1.6400zz", "avc1.6400330",
                            "avc1.64000a", "hvc1.1.6.L93.B0", "avc1.64 033"}) {
    VideoChoice video(true);
    video.announced({other});
    EXPECT_EQ(frames_until_change(video, 2 * budget, 2 * budget), 0) << other;
  }
}

TEST(VideoChoice, PicturesKeepToTheLevelAnnounced) {
  // ITU-T H.264, table A-1: 1620 macroblocks at level 3, 3600 at 3.1.
  VideoChoice video(true);
  video.announced({"avc1.64001e"});
  EXPECT_TRUE(video.fits(720, 576));
  EXPECT_FALSE(video.fits(721, 576));
  video.announced({"avc1.64001e", "avc1.64001f"});
  EXPECT_TRUE(video.fits(1280, 720));
  EXPECT_FALSE(video.fits(1296, 720));
  EXPECT_FALSE(video.fits(640, 15));
  // A.3.1: an edge has at most sqrt(8 x 3600) = 169.7 macroblocks.
  EXPECT_TRUE(video.fits(169 * 16, 16));
  EXPECT_FALSE(video.fits(170 * 16, 16));
  EXPECT_FALSE(video.fits(16, 170 * 16));
  video.announced({"avc1.640033"});
  EXPECT_TRUE(video.fits(1920, 1088));
  EXPECT_FALSE(video.fits(1920, 1104)) << "beyond the encoder";
}

Options with_video() {
  Options options;
  options.video = true;
  return options;
}

// A client behind a link of 250 kB/s that moves the camera; frames of 20 kB.
class SlowViewer : public Driver {
 public:
  explicit SlowViewer(const std::vector<std::string>& codecs = high) : Driver(with_video()) {
    payload_bytes = 20'000;
    if (!codecs.empty()) say(protocol::VideoMessage{codecs});
    patch(1, R"({"dataset":"wind","image":{"width":1280,"height":720}})");
    finish_render();
    ack(1);  // the round trip takes no time
  }

  // Sends and acknowledges that many moving frames; returns the new ones.
  std::vector<SendFrame> move(int count) {
    std::vector<SendFrame> out;
    for (int n = 0; n < count; ++n) {
      ++rev_;
      patch(rev_, azimuth(static_cast<int>(rev_)));
      if (!render) wait(30 * ms);
      if (!render) continue;
      finish_render();
      out.push_back(frames.back());
      wait(80 * ms);
      ack(frames.back().header.seq);
    }
    return out;
  }
  // Moves until a frame of H.264 was sent.
  void begin_video() {
    for (int n = 0; n < 20; ++n) {
      move(1);
      if (frames.back().header.codec == Codec::h264) return;
    }
    FAIL() << "no video";
  }

 private:
  std::uint32_t rev_ = 1;
};

bool is_key(const SendFrame& frame) { return (frame.header.flags & protocol::flag_key) != 0; }

// The next moving frame of a view that changes.
SendFrame next_moving(SlowViewer& viewer) {
  const std::size_t before = viewer.frames.size();
  viewer.move(1);
  for (std::size_t n = before; n < viewer.frames.size(); ++n) {
    if (!Driver::is_final(viewer.frames[n])) return viewer.frames[n];
  }
  ADD_FAILURE() << "no moving frame";
  return {};
}

TEST(Video, MovingFramesOfASlowLinkAreVideoAndFinalOnesAreNot) {
  SlowViewer viewer;
  viewer.begin_video();
  viewer.move(5);
  viewer.settle();
  int keys = 0;
  bool begun = false;
  for (const SendFrame& frame : viewer.frames) {
    const bool video = frame.header.codec == Codec::h264;
    begun = begun || video;
    EXPECT_EQ(video, begun && !Driver::is_final(frame));
    EXPECT_TRUE(video || !is_key(frame));
    keys += is_key(frame) ? 1 : 0;
  }
  EXPECT_TRUE(Driver::is_final(viewer.frames.back()));
  EXPECT_EQ(keys, 1);
}

TEST(Video, ClientsThatAnnounceNothingGetJpegOnly) {
  SlowViewer viewer(std::vector<std::string>{});
  viewer.move(30);
  for (const SendFrame& frame : viewer.frames) EXPECT_EQ(frame.header.codec, Codec::jpeg);
}

TEST(Video, AFrameEncodedAndNotSentIsFollowedByAKeyFrame) {
  SlowViewer viewer;
  viewer.begin_video();
  EXPECT_FALSE(is_key(next_moving(viewer)));
  viewer.patch(1000, azimuth(1000));
  viewer.wait(100 * ms);
  ASSERT_TRUE(viewer.render);
  ASSERT_EQ(viewer.render->encoding.codec, Codec::h264);
  viewer.say(protocol::VisibilityMessage{true});
  viewer.finish_render();
  viewer.say(protocol::VisibilityMessage{false});
  if (viewer.render) {
    EXPECT_TRUE(viewer.render->encoding.key);
  } else {
    EXPECT_TRUE(is_key(next_moving(viewer)));
  }
}

TEST(Video, AnnouncingAgainGivesAKeyFrameEvenDuringARender) {
  SlowViewer viewer;
  viewer.begin_video();
  EXPECT_FALSE(is_key(next_moving(viewer)));
  viewer.say(protocol::VideoMessage{high});
  EXPECT_TRUE(is_key(next_moving(viewer)));
  EXPECT_FALSE(is_key(next_moving(viewer)));
  viewer.patch(2000, azimuth(2000));
  viewer.wait(10 * ms);
  ASSERT_TRUE(viewer.render);
  ASSERT_FALSE(viewer.render->encoding.key);
  viewer.say(protocol::VideoMessage{high});
  viewer.finish_render();
  viewer.wait(80 * ms);
  viewer.ack(viewer.frames.back().header.seq);
  EXPECT_TRUE(is_key(next_moving(viewer)));
}

TEST(Video, WithdrawnAnnouncementGivesJpegAndFreesTheEncoder) {
  SlowViewer viewer;
  viewer.begin_video();
  EXPECT_EQ(viewer.videos_ended, 0);
  viewer.say(protocol::VideoMessage{});
  EXPECT_EQ(next_moving(viewer).header.codec, Codec::jpeg);
  EXPECT_EQ(viewer.videos_ended, 1);
}

TEST(Video, UnusedEncoderIsFreedAndTheNextFrameIsAKeyFrame) {
  SlowViewer viewer;
  viewer.begin_video();
  viewer.settle();
  EXPECT_EQ(viewer.videos_ended, 0);
  viewer.wait(VideoChoice::unused_us);
  EXPECT_EQ(viewer.videos_ended, 1);
  const SendFrame next = next_moving(viewer);
  EXPECT_EQ(next.header.codec, Codec::h264);
  EXPECT_TRUE(is_key(next));
}

TEST(Video, FailureOfTheEncoderGivesJpegForAWhile) {
  SlowViewer viewer;
  viewer.begin_video();
  viewer.video_fails = true;
  EXPECT_EQ(next_moving(viewer).header.codec, Codec::jpeg);
  viewer.video_fails = false;
  EXPECT_EQ(next_moving(viewer).header.codec, Codec::jpeg);
  EXPECT_EQ(viewer.videos_ended, 1);
  viewer.settle();
  viewer.wait(VideoChoice::retry_us);
  viewer.begin_video();
}

TEST(Video, AnotherSizeOfThePictureIsAKeyFrameOfTheQualityOfAJpeg) {
  SlowViewer viewer;
  viewer.begin_video();
  viewer.move(3);
  viewer.patch(3000, R"({"image":{"width":1000,"height":700}})");
  viewer.wait(100 * ms);
  ASSERT_TRUE(viewer.render);
  EXPECT_EQ(viewer.render->encoding.codec, Codec::h264);
  EXPECT_TRUE(viewer.render->encoding.key);
}

TEST(Video, TheSameNumberOfPixelsInAnotherShapeIsAKeyFrame) {
  SlowViewer viewer;
  viewer.begin_video();
  viewer.move(3);
  viewer.patch(3000, R"({"image":{"width":720,"height":1280}})");
  viewer.wait(100 * ms);
  ASSERT_TRUE(viewer.render);
  EXPECT_EQ(viewer.render->encoding.codec, Codec::h264);
  EXPECT_TRUE(viewer.render->encoding.key);
}

}  // namespace
}  // namespace session_test
