// Codec, size and rarity of changes of moving frames, from links of known rate.
#include "server/session/pacing/moving_encoding.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace moving_test {
namespace {

using namespace windsplat::session;  // NOLINT(google-build-using-namespace)
namespace protocol = windsplat::protocol;
namespace quality = windsplat::quality;

constexpr Micros milli = 1000;
constexpr Micros budget = 33 * milli;

// An idle link of that rate, in bytes/s, with a round trip of 20 ms.
Link link_of(double rate) {
  constexpr std::size_t bytes = 100'000;
  constexpr Micros trip = 20 * milli;
  Link link;
  Micros now = 1'000'000;
  for (std::uint32_t seq = 1; seq <= 3; ++seq) {
    link.sent({seq, bytes, now - 10 * milli, true}, now);
    link.answered(seq, now + trip);
    now += trip + static_cast<Micros>(1e6 * static_cast<double>(bytes) / rate);
    link.acked(seq, 0, now);
  }
  return link;
}

protocol::View view_of(int width, int height) {
  protocol::View view;
  view.image.width = width;
  view.image.height = height;
  return view;
}

// A frame drawn of a size, whose bytes have the factor c of a model.
struct Sent {
  int width;
  int height;
  double factor;
  bool video = false;
  bool key = false;
  int quality = 75;

  [[nodiscard]] Drawn drawn() const {
    Drawn out;
    out.info.width = width;
    out.info.height = height;
    out.video = video;
    out.key = key;
    return out;
  }
  [[nodiscard]] std::size_t bytes() const {
    const BytesModel& model = video ? video_bytes : jpeg_bytes;
    const double scale = quality < 50 ? 50.0 / quality : 2 - quality / 50.0;
    const double pixels = static_cast<double>(width) * height;
    const double body = factor * std::pow(pixels, 0.8) * std::pow(scale, -model.scale_power);
    return static_cast<std::size_t>(model.head_bytes + body);
  }
};

// A session with a client that decodes H.264.
struct Moving {
  Link link;
  VideoChoice video{true};
  MovingEncoding encoding;

  explicit Moving(double rate, const char* codec = "avc1.640033") : link(link_of(rate)) {
    video.announced({codec});
  }
  void learn(const Sent& sent) { encoding.learn(sent.drawn(), sent.quality, sent.bytes(), 1700); }
  void learn_final(const Sent& sent) {
    encoding.learn_final(sent.drawn(), sent.quality, sent.bytes());
  }
  // The least level after `frames` choices.
  int least_level(const protocol::View& view, int frames) {
    int level = 0;
    for (int n = 0; n < frames; ++n) {
      level = encoding.least_level(view, link, video, budget, 0);
    }
    return level;
  }
};

// 2560 x 1440 is beyond the encoder; its half is not. The link carries it as H.264, but not as a
// JPEG of full size.
TEST(MovingEncoding, PicturesTooLargeForVideoAreDrawnAtALevelThatCanBeVideo) {
  Moving moving(1.2e6);
  const protocol::View view = view_of(2560, 1440);
  moving.learn({1280, 720, 2.0});
  const int level = moving.least_level(view, 20);
  ASSERT_TRUE(moving.video.on());
  ASSERT_FALSE(moving.video.fits(2560, 1440));
  moving.learn({1280, 720, 0.05, true});
  EXPECT_EQ(moving.least_level(view, 20), 1) << "at first " << level;
  quality::Setting half;
  half.half_level = 2;
  const Encoding chosen = moving.encoding.choose(view, half, moving.link, moving.video, budget);
  EXPECT_EQ(chosen.codec, protocol::Codec::h264);
}

// Otherwise video would cost more of the picture than it saves.
TEST(MovingEncoding, PicturesTooLargeForVideoStayJpegWhereTheLinkCarriesTheirSize) {
  Moving moving(1.2e6);
  const protocol::View view = view_of(2560, 1440);
  moving.learn({1280, 720, 0.6});
  ASSERT_EQ(moving.least_level(view, 20), 0);
  ASSERT_TRUE(moving.video.on());
  const Encoding chosen = moving.encoding.choose(view, {}, moving.link, moving.video, budget);
  EXPECT_EQ(chosen.codec, protocol::Codec::jpeg);
}

TEST(MovingEncoding, BytesOfJpegFollowFinalFramesWhileMovingOnesAreVideo) {
  Moving moving(1e6);
  const double pixels = 1280.0 * 720;
  constexpr double fuller = 1.3;  // final frames have full chroma
  moving.learn_final({1280, 720, fuller * 2.0, false, false, 92});
  moving.learn({1280, 720, 2.0});
  const double before = moving.encoding.jpeg_bytes_at(pixels, 75);
  moving.learn_final({1280, 720, fuller * 1.0, false, false, 92});
  EXPECT_EQ(moving.encoding.jpeg_bytes_at(pixels, 75), before)
      << "moving frames tell it themselves";
  moving.learn_final({1280, 720, fuller * 2.0, false, false, 92});
  moving.learn({1280, 720, 0.3, true});
  for (const double factor : {0.5, 4.0}) {
    moving.learn_final({1280, 720, fuller * factor, false, false, 92});
    const Sent jpeg{1280, 720, factor};
    const auto expected = static_cast<double>(jpeg.bytes());
    EXPECT_NEAR(moving.encoding.jpeg_bytes_at(pixels, 75), expected, 0.01 * expected);
  }
}

// Without it video lasts for ever, since it shows nothing of what a JPEG would need.
TEST(MovingEncoding, ContentThatGrewSimpleEndsVideoOnTheSameLink) {
  Moving moving(1e6);
  const protocol::View view = view_of(1280, 720);
  moving.learn_final({1280, 720, 2.6, false, false, 92});
  moving.learn({1280, 720, 2.0});
  moving.least_level(view, 20);
  ASSERT_TRUE(moving.video.on());
  moving.learn({1280, 720, 0.3, true});
  moving.learn_final({1280, 720, 0.13, false, false, 92});
  moving.least_level(view, 20);
  EXPECT_FALSE(moving.video.on());
}

TEST(MovingEncoding, SizesOfVideoChangeSoRarelyThatKeyFramesTakeLittleOfTheLink) {
  constexpr Micros usual = 1'000'000;
  const protocol::View view = view_of(1280, 720);
  Micros before = MovingEncoding::calm_most_us;
  for (const double rate : {6.25e4, 2.5e5, 1.25e6}) {
    Moving moving(rate);
    EXPECT_EQ(moving.encoding.calm(view, moving.link, moving.video, usual), usual) << "JPEG";
    moving.least_level(view, 20);
    ASSERT_TRUE(moving.video.on());
    const Micros calm = moving.encoding.calm(view, moving.link, moving.video, usual);
    EXPECT_LE(calm, before) << "a faster link changes at least as often";
    before = calm;
    const double key_us = 1e6 * moving.encoding.jpeg_bytes_at(1280.0 * 720, 75) / rate;
    const double held_us = std::min(key_us, 1.0 * JpegRate::moving_most_us);
    EXPECT_NEAR(static_cast<double>(calm), held_us / MovingEncoding::key_share, 0.02 * 1e6) << rate;
  }
}

}  // namespace
}  // namespace moving_test
