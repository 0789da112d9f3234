// Estimates for links of known rate and delay, against closed forms. Times are microseconds.
#include "server/session/pacing/link.hpp"

#include <gtest/gtest.h>

#include "server/session/pacing/jpeg_rate.hpp"

namespace windsplat::session {
namespace {

constexpr Micros milli = 1000;

// A link with `rate` bytes/s and round trip `trip` that carries one frame at a time.
struct Known {
  double rate = 1e6;
  Micros trip = 40 * milli;
  Micros decode = 0;
  Micros now = 1'000'000;
  std::uint32_t seq = 0;

  [[nodiscard]] Micros carries(std::size_t bytes) const {
    return static_cast<Micros>(1e6 * static_cast<double>(bytes) / rate);
  }
  void send(Link& link, std::size_t bytes, bool pong = true, Micros late = 0) {
    link.sent({++seq, bytes, now - 10 * milli, true}, now);
    if (pong) link.answered(seq, now + trip);
    now += trip + carries(bytes) + decode + late;
    link.acked(seq, 1e-3 * static_cast<double>(decode), now);
  }
};

TEST(Link, HasNoEstimateBeforeAnAcknowledgement) {
  Link link;
  EXPECT_FALSE(link.known());
  EXPECT_EQ(link.may_start_at(), 0);
  link.sent({1, 1000, 0, true}, 10);
  EXPECT_FALSE(link.known());
  EXPECT_EQ(link.may_start_at(), 0) << "only credit delays it";
  EXPECT_EQ(link.bytes_in_flight(), 1000U);
}

TEST(Link, EstimatesRateAndRoundTripAtAnyDistance) {
  for (const double rate : {6e4, 2.5e5, 1.25e6, 1.25e7}) {
    for (const Micros trip : {2 * milli, 40 * milli, 400 * milli}) {
      for (const Micros decode : {0 * milli, 15 * milli}) {
        SCOPED_TRACE(std::to_string(rate) + " bytes/s " + std::to_string(trip) + " us");
        Known known{rate, trip, decode};
        Link link;
        for (const std::size_t bytes : {50'000U, 90'000U, 70'000U}) known.send(link, bytes);
        EXPECT_EQ(link.round_trip(), trip);
        EXPECT_NEAR(link.bytes_per_s(), rate, 0.001 * rate);
        EXPECT_NEAR(static_cast<double>(link.transfer(1e5)), 1e11 / rate, 1e8 / rate);
        EXPECT_EQ(link.bytes_in_flight(), 0U);
      }
    }
  }
}

TEST(Link, OneDelayedFrameLowersNothing) {
  Known known;
  Link link;
  for (int n = 0; n < 5; ++n) known.send(link, 50'000);
  for (int n = 0; n < 5; ++n) known.send(link, 50'000, true, 80 * milli);
  EXPECT_NEAR(link.bytes_per_s(), known.rate, 0.001 * known.rate);
}

TEST(Link, TwoSlowFramesLowerTheRate) {
  Known known;
  Link link;
  for (int n = 0; n < 20; ++n) known.send(link, 50'000);
  known.rate = 1e5;
  known.send(link, 50'000);
  EXPECT_NEAR(link.bytes_per_s(), 1e6, 1e3) << "one frame may have been delayed";
  known.send(link, 50'000);
  EXPECT_NEAR(link.bytes_per_s(), 1e5, 1e2);
}

TEST(Link, SmallFramesLowerNothingAndLargerOnesDo) {
  Known known;
  known.rate = 2e6;
  Link link;
  known.send(link, 100'000);
  for (int n = 0; n < 100; ++n) known.send(link, 200, true, 2 * milli);
  EXPECT_NEAR(link.bytes_per_s(), 2e6, 2e3);
  known.rate = 1e5;
  for (int n = 0; n < 8; ++n) known.send(link, 100'000);
  EXPECT_NEAR(link.bytes_per_s(), 1e5, 1e2) << "the link has become slow";
}

TEST(Link, WithoutPongsTheSmallestFrameGivesTheRoundTrip) {
  Known known;
  Link link;
  known.send(link, 1'000, false);
  EXPECT_EQ(link.round_trip(), known.trip + 1 * milli);
  EXPECT_FALSE(link.known());
  for (int n = 0; n < 3; ++n) known.send(link, 100'000, false);
  EXPECT_NEAR(link.bytes_per_s(), known.rate, 0.02 * known.rate);
}

TEST(Link, LongerRoundTripIsAcceptedAfterAWhile) {
  Known known;
  Link link;
  known.send(link, 50'000);
  known.trip = 90 * milli;
  while (known.now < 30'000'000) known.send(link, 50'000);
  EXPECT_EQ(link.round_trip(), 90 * milli);
  EXPECT_NEAR(link.bytes_per_s(), known.rate, 0.001 * known.rate);
}

TEST(Link, ConsecutiveFramesRevealTheRateHiddenByTheSecond) {
  const Micros trip = 20 * milli;
  const double rate = 1e6;
  Link link;
  Micros now = 1'000'000;
  link.sent({1, 50'000, now, true}, now);
  link.answered(1, now + trip);
  link.sent({2, 50'000, now, true}, now);
  link.acked(2, 0, now + trip + 100 * milli);  // acknowledges both
  EXPECT_NEAR(link.bytes_per_s(), rate, 0.001 * rate);
}

TEST(Link, NextFrameStartsSoThatTheLinkIsFree) {
  Known known;  // 1 MB/s; frames take 10 ms to render
  known.trip = 4 * milli;
  Link link;
  for (int n = 0; n < 4; ++n) known.send(link, 60'000);
  const Micros sent = known.now;
  link.sent({++known.seq, 60'000, sent - 10 * milli, true}, sent);
  EXPECT_NEAR(static_cast<double>(link.free_at()), static_cast<double>(sent + 60 * milli), 100);
  EXPECT_NEAR(static_cast<double>(link.may_start_at()), static_cast<double>(sent + 50 * milli),
              100);
  link.acked(known.seq, 0, sent + 30 * milli);
  EXPECT_EQ(link.may_start_at(), 0) << "nothing is in flight";
}

TEST(Link, NextFrameStartsSoThatTheClientIsFree) {
  Known known;
  known.trip = 4 * milli;
  known.decode = 200 * milli;
  Link link;
  for (int n = 0; n < 12; ++n) known.send(link, 20'000);
  const Micros sent = known.now;
  link.sent({++known.seq, 20'000, sent - 10 * milli, true}, sent);
  // It arrives 20 ms later and takes 200 ms to decode; the next one takes 10 ms to render and 20 ms
  // to arrive.
  EXPECT_NEAR(static_cast<double>(link.may_start_at()),
              static_cast<double>(sent + (20 + 200 - 20 - 10) * milli), 1.0 * milli);
}

TEST(Link, DistantClientsGetTheirTwoFramesEvenlySpaced) {
  Known known;
  known.rate = 1e8;
  known.trip = 400 * milli;
  Link link;
  for (int n = 0; n < 4; ++n) known.send(link, 60'000);
  const Micros begun = known.now - 10 * milli;
  link.sent({++known.seq, 60'000, begun, true}, known.now);
  const double cycle = 10 + 0.6 + 400;
  EXPECT_NEAR(static_cast<double>(link.may_start_at() - begun), 0.45 * 1000 * cycle, 1000);
}

// --- JPEG ---------------------------------------------------------------------------------------

// An idle link of that rate.
Link link_of(double rate) {
  Known known;
  known.rate = rate;
  Link link;
  for (int n = 0; n < 3; ++n) known.send(link, 100'000);
  return link;
}

constexpr Micros budget = 33 * milli;
constexpr double full = 1280 * 720;

// Frames whose bytes follow the model with c = 0.7 at the chosen quality.
int settled(JpegRate& jpeg, const Link& link, double pixels) {
  int quality = 0;
  for (int n = 0; n < 20; ++n) {
    quality = jpeg.choose(pixels, link, budget);
    const double scale = quality < 50 ? 50.0 / quality : 2 - quality / 50.0;
    const double bytes = 620 + 0.7 * std::pow(pixels, 0.8) * std::pow(scale, -0.47);
    jpeg.learn(pixels, quality, static_cast<std::size_t>(bytes), 1700);
    EXPECT_NEAR(jpeg.predicted_bytes(pixels, quality), bytes, 0.02 * bytes);
  }
  return quality;
}

TEST(JpegRate, QualityFollowsTheLinkRate) {
  int before = 0;
  for (const double rate : {1e5, 1.6e6, 2.2e6, 4e6, 1.2e7, 1e8}) {
    JpegRate jpeg;
    const Link link = link_of(rate);
    const int quality = settled(jpeg, link, full);
    EXPECT_GE(quality, before);
    before = quality;
    const double on_link = (jpeg.predicted_bytes(full, quality) + 1700) / rate;  // s
    if (quality > 40) {
      EXPECT_LE(on_link, quality > 75 ? 0.033 / 4 : 0.033) << rate;
    }
    if (rate == 1e5) {
      EXPECT_EQ(quality, 40);
    }
    if (rate == 4e6) {
      EXPECT_EQ(quality, 75) << "it would fit at 80, but not in a quarter of the time";
    }
    if (rate == 1e8) {
      EXPECT_EQ(quality, 85);
    }
  }
}

TEST(JpegRate, IsDefaultWhileTheLinkIsUnknown) {
  JpegRate jpeg;
  const Link link;
  EXPECT_EQ(jpeg.choose(full, link, budget), 75);
  EXPECT_EQ(jpeg.least_level(1280, 720, link, budget), 0);
}

TEST(JpegRate, LevelChangesWhenTheLowestQualityIsTooLarge) {
  int before = 4;
  for (const double rate : {1e4, 6.25e4, 2.5e5, 4e5, 1e6}) {
    JpegRate jpeg;
    const Link link = link_of(rate);
    settled(jpeg, link, 57'600);
    const double most = jpeg.pixels_max(link, budget);
    int level = 0;
    for (int n = 0; n < 5; ++n) level = jpeg.least_level(1280, 720, link, budget);
    EXPECT_LE(level, before);
    before = level;
    // The most pixels that fit within moving_most_us, if any do.
    const double bytes = jpeg.predicted_bytes(most, JpegRate::quality_least) + 1700;
    if (rate > 5e4) {
      EXPECT_NEAR(bytes / rate, 0.125, 0.002) << rate;
    }
    const double drawn = full / std::pow(4, level);
    if (level < 3) {
      EXPECT_LE(drawn, 1.25 * most);
    }
    if (level > 0) {
      EXPECT_GT(4 * drawn, most) << "not coarser than necessary";
    }
  }
  EXPECT_EQ(before, 0);
}

TEST(JpegRate, SmallVariationsOfPicturesKeepTheLevel) {
  // However close the rate is to a change of level.
  for (double rate = 1e5; rate < 3e5; rate *= 1.03) {
    JpegRate jpeg;
    const Link link = link_of(rate);
    std::vector<int> levels;
    for (int n = 0; n < 60; ++n) {
      const double bytes = 9000 * (1 + 0.05 * std::sin(0.4 * n));
      jpeg.learn(150'000, 40, static_cast<std::size_t>(bytes), 1700);
      levels.push_back(jpeg.least_level(1280, 720, link, budget));
    }
    EXPECT_EQ(*std::max_element(levels.begin() + 20, levels.end()), levels.back());
    EXPECT_EQ(*std::min_element(levels.begin() + 20, levels.end()), levels.back());
  }
}

TEST(JpegRate, RecoveredLinkIsUsedAfterAFewFrames) {
  JpegRate jpeg;
  const Link slow = link_of(1e5);
  settled(jpeg, slow, 57'600);
  const int coarse = jpeg.least_level(1280, 720, slow, budget);
  ASSERT_GE(coarse, 1);
  const Link fast = link_of(1e7);
  for (int n = 1; n < 4; ++n) EXPECT_EQ(jpeg.least_level(1280, 720, fast, budget), coarse);
  EXPECT_EQ(jpeg.least_level(1280, 720, fast, budget), coarse - 1);
}

}  // namespace
}  // namespace windsplat::session
