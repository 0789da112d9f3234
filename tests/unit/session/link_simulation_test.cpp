// Pacing on simulated links: age of frames on arrival, frame rate, queueing.
//  The age of a frame is its arrival less t of the newest patch it shows, on the client's clock.
//  Link time is the transmission time of that patch and of the frame: 2 delay, plus the bytes of
//  the frame and its text messages divided by the rate. A render interval is the median time
//  between the starts of consecutive renders of moving frames. Then
//  p99(age - link time) <= 2 render intervals.
#include <gtest/gtest.h>

#include "simulation.hpp"

namespace session_test {
namespace {

using namespace sim;  // NOLINT(google-build-using-namespace)

constexpr Micros milli = 1000;
constexpr double mbit = 125'000;  // bytes/s

Micros quantile(std::vector<Micros> values, double share) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

struct Told {
  std::vector<Shown> moving;
  Micros interval = 0;
  std::vector<Micros> beyond;  // age - link time
  std::vector<Micros> waited;  // from the arrival of the patch shown to the start of the render
  double mean_link_us = 0;     // bytes of a frame over the rate
};

Told tell(const Viewer& viewer, const LinkOptions& link) {
  Told told;
  for (const Shown& frame : viewer.frames) {
    if (!frame.final) told.moving.push_back(frame);
  }
  std::vector<Micros> intervals;
  for (std::size_t n = 1; n < viewer.begun.size(); ++n) {
    intervals.push_back(viewer.begun[n] - viewer.begun[n - 1]);
  }
  told.interval = quantile(intervals, 0.5);
  for (std::size_t n = 0; n < told.moving.size(); ++n) {
    const Shown& frame = told.moving[n];
    const double carried = 1e6 * frame.wire_bytes / link.bytes_per_s;
    told.mean_link_us += carried / static_cast<double>(told.moving.size());
    told.beyond.push_back(frame.arrived - frame.t - 2 * link.delay - static_cast<Micros>(carried));
    // After the last patch there is no newer view.
    if (frame.rev == viewer.rev()) continue;
    told.waited.push_back(viewer.begun.at(n) - frame.t - link.delay);
  }
  return told;
}

constexpr double whole = 1280 * 720;  // pixels

// Median render time of the moving frames.
Micros drawing_time(const Told& told, Micros full) {
  std::vector<Micros> costs;
  for (const Shown& frame : told.moving) {
    costs.push_back(static_cast<Micros>(static_cast<double>(full) * frame.pixels / whole));
  }
  return quantile(costs, 0.5);
}

struct Case {
  LinkOptions link;
  Micros full = 0;  // render time of a whole picture
};

std::vector<Case> cases() {
  std::vector<Case> out;
  for (const double rate : {0.5, 2.0, 10.0, 100.0, 1000.0}) {
    for (const Micros delay : {1 * milli, 20 * milli, 200 * milli}) {
      for (const Micros decode : {1 * milli, 150 * milli}) {
        for (const Micros full : {25 * milli, 150 * milli}) {
          out.push_back({{rate * mbit, delay, decode}, full});
        }
      }
    }
  }
  return out;
}

std::string name(const Case& c) {
  return std::to_string(c.link.bytes_per_s / mbit) + " Mbit/s, " +
         std::to_string(c.link.delay / milli) + " ms one way, decoding " +
         std::to_string(c.link.decode / milli) + " ms, a whole picture " +
         std::to_string(c.full / milli) + " ms";
}

TEST(Simulated, FramesAreRecentAndAsManyAsTheLinkAllows) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(name(c));
    Clock clock;
    Renderer renderer(clock, c.full);
    Viewer viewer(clock, renderer, c.link);
    const Micros begin = clock.now();
    viewer.drag(begin + 20 * second);
    clock.run_until(begin + 30 * second);
    const Told told = tell(viewer, c.link);
    ASSERT_GT(told.moving.size(), 40U);

    EXPECT_LE(quantile(told.beyond, 0.99), 2 * told.interval);
    EXPECT_LE(*std::max_element(told.waited.begin(), told.waited.end()), Viewer::patch_every)
        << "every render is of the newest view";
    // The limit of the rate: patches, drawing, the link, the client, or two frames per cycle.
    const auto drawing = static_cast<double>(drawing_time(told, c.full));
    const double delay = static_cast<double>(c.link.delay);
    const double decode = static_cast<double>(c.link.decode);
    const double cycle = drawing + told.mean_link_us + 2 * delay + decode;
    const double ideal = std::max(
        {static_cast<double>(Viewer::patch_every), drawing, told.mean_link_us, decode, cycle / 2});
    EXPECT_GE(static_cast<double>(told.moving.size()), 0.7 * 20e6 / ideal);
    EXPECT_LE(viewer.unacked_most, 2U);
    EXPECT_LE(viewer.held_most, 2U);
    for (std::size_t n = 1; n < viewer.frames.size(); ++n) {
      EXPECT_GE(viewer.frames[n].rev, viewer.frames[n - 1].rev);
    }
    EXPECT_TRUE(viewer.frames.back().final);
    EXPECT_EQ(viewer.frames.back().rev, viewer.rev());
  }
}

TEST(Simulated, MovingFramesLeaveTheLinkSoonAndAreGoodOnAFastLink) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(name(c));
    Clock clock;
    Renderer renderer(clock, c.full);
    Viewer viewer(clock, renderer, c.link);
    const Micros begin = clock.now();
    viewer.drag(begin + 10 * second);
    clock.run_until(begin + 10 * second);
    // The first frames were sent before the link was known.
    std::vector<Micros> on_link;
    for (std::size_t n = 3; n < viewer.frames.size(); ++n) {
      on_link.push_back(
          static_cast<Micros>(1e6 * viewer.frames[n].wire_bytes / c.link.bytes_per_s));
      EXPECT_GE(viewer.frames[n].quality, 40);
      EXPECT_LE(viewer.frames[n].quality, 85);
    }
    ASSERT_FALSE(on_link.empty());
    EXPECT_LE(quantile(on_link, 1), 300 * milli);
    // 1280x720 at quality 85 are about 80 kB: 6 ms at 100 Mbit/s, less than a quarter of 33 ms.
    const Shown& last = viewer.frames.back();
    if (c.link.bytes_per_s >= 100 * mbit) {
      EXPECT_EQ(last.quality, 85);
      if (c.full <= 25 * milli) {
        EXPECT_EQ(last.pixels, whole);
      }
    }
    if (c.link.bytes_per_s <= mbit) {
      EXPECT_EQ(last.quality, 40);
      EXPECT_LE(last.pixels, whole / 16);
      EXPECT_GE(last.pixels, whole / 40) << "not coarser than necessary";
    }
  }
}

TEST(Simulated, SlowingAndRecoveringLinkIsFollowed) {
  Clock clock;
  Renderer renderer(clock, 10 * milli);
  LinkOptions fast{50 * mbit, 10 * milli, 3 * milli};
  Viewer viewer(clock, renderer, fast);
  const Micros begin = clock.now();
  viewer.drag(begin + 60 * second);
  clock.at(begin + 20 * second, [&] { viewer.set_rate(1 * mbit); });
  clock.at(begin + 40 * second, [&] { viewer.set_rate(50 * mbit); });
  clock.run_until(begin + 60 * second);
  int slow_frames = 0;
  Micros recovered = 0;
  for (const Shown& frame : viewer.frames) {
    if (frame.arrived > begin + 22 * second && frame.arrived < begin + 40 * second) {
      EXPECT_LE(frame.wire_bytes / mbit, 0.3) << "s on the link";
      ++slow_frames;
    }
    const bool good = frame.pixels == whole && frame.quality >= 75;
    if (frame.arrived > begin + 40 * second && good && recovered == 0) recovered = frame.arrived;
  }
  EXPECT_GE(slow_frames, 18 * 7) << "at least seven per second";
  ASSERT_GT(recovered, 0);
  EXPECT_LE(recovered, begin + 43 * second);
}

TEST(Simulated, ShortRestDoesNotFillASlowLinkWithAFinalFrame) {
  for (const double rate : {0.5, 100.0}) {
    SCOPED_TRACE(rate);
    Clock clock;
    Renderer renderer(clock, 10 * milli);
    Viewer viewer(clock, renderer, {rate * mbit, 10 * milli, 3 * milli});
    const Micros begin = clock.now();
    viewer.drag(begin + 1 * second);
    clock.run_until(begin + 10 * second);
    ASSERT_TRUE(viewer.frames.back().final);
    const std::size_t before = viewer.frames.size();
    for (int n = 0; n < 8; ++n) {  // input for 1 s, then 0.5 s of rest
      viewer.drag(clock.now() + 1 * second);
      clock.run_until(clock.now() + 1500 * milli);
    }
    std::size_t finals = 0;
    for (std::size_t n = before; n < viewer.frames.size(); ++n) {
      finals += viewer.frames[n].final ? 1U : 0U;
    }
    EXPECT_EQ(finals, rate < 1 ? 0U : 8U);
    clock.run_until(clock.now() + 10 * second);
    EXPECT_TRUE(viewer.frames.back().final);
    EXPECT_EQ(viewer.frames.back().rev, viewer.rev());
  }
}

TEST(Simulated, HiddenSessionRendersNothing) {
  Clock clock;
  Renderer renderer(clock, 10 * milli);
  Viewer viewer(clock, renderer, {10 * mbit, 20 * milli, 3 * milli});
  const Micros begin = clock.now();
  viewer.drag(begin + 6 * second);
  clock.at(begin + 2 * second, [&] { viewer.say(protocol::VisibilityMessage{true}); });
  clock.run_until(begin + 2 * second + 20 * milli);
  const int renders = renderer.renders;
  EXPECT_GT(renders, 20);
  clock.run_until(begin + 4 * second);
  EXPECT_EQ(renderer.renders, renders);
  viewer.say(protocol::VisibilityMessage{false});
  clock.run_until(begin + 8 * second);
  EXPECT_TRUE(viewer.frames.back().final);
  EXPECT_EQ(viewer.frames.back().rev, viewer.rev());
}

TEST(Simulated, SlowSessionDoesNotSlowAnother) {
  const LinkOptions fast{1000 * mbit, 1 * milli, 2 * milli};
  const LinkOptions slow{0.5 * mbit, 200 * milli, 300 * milli};
  std::vector<double> count;
  std::vector<Told> told;
  for (const bool alone : {true, false}) {
    Clock clock;
    Renderer renderer(clock, 20 * milli);
    Viewer quick(clock, renderer, fast);
    Viewer other(clock, renderer, slow);
    const Micros begin = clock.now();
    quick.drag(begin + 20 * second);
    if (!alone) other.drag(begin + 20 * second);
    clock.run_until(begin + 20 * second);
    told.push_back(tell(quick, fast));
    count.push_back(static_cast<double>(told.back().moving.size()));
    EXPECT_EQ(other.frames.empty(), alone);
  }
  // Only the few renders of the other session are missing.
  EXPECT_GE(count[1], 0.9 * count[0]);
  EXPECT_LE(quantile(told[1].beyond, 0.99), 2 * told[1].interval + 20 * milli);
}

TEST(Simulated, MessagesWaitForOneFrameAtMost) {
  for (const double rate : {0.5, 2.0, 10.0}) {
    SCOPED_TRACE(rate);
    Clock clock;
    Renderer renderer(clock, 10 * milli);
    const LinkOptions link{rate * mbit, 20 * milli, 5 * milli};
    Viewer viewer(clock, renderer, link);
    const Micros begin = clock.now();
    viewer.drag(begin + 20 * second);
    std::vector<Micros> waits;
    for (int n = 0; n < 150; ++n) {
      const Micros at = begin + 4 * second + n * 103 * milli;
      clock.at(at, [&, at] {
        viewer.ask([&, at](Micros answered) { waits.push_back(answered - at - 2 * link.delay); });
      });
    }
    clock.run_until(begin + 20 * second);
    ASSERT_EQ(waits.size(), 150U);
    double largest = 0;
    for (const Shown& frame : viewer.frames) {
      if (frame.arrived > begin + 4 * second) largest = std::max(largest, frame.wire_bytes);
    }
    const double one_frame = 1e6 * (largest + 2 * 150) / link.bytes_per_s;
    EXPECT_LE(static_cast<double>(quantile(waits, 1)), one_frame);
    EXPECT_LE(quantile(waits, 1), 300 * milli);
  }
}

}  // namespace
}  // namespace session_test
