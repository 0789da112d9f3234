// The link to a viewer, estimated from when frames went and were acknowledged: times in, facts out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

namespace windsplat::session {

using Micros = std::int64_t;  // microseconds of a clock that only goes forward

// The least of the last one to two `window_us`.
class WindowedLeast {
 public:
  explicit WindowedLeast(Micros window_us) : window_us_(window_us) {}
  void add(Micros value, Micros now);
  [[nodiscard]] bool known() const { return count_ > 0; }
  [[nodiscard]] Micros value() const { return count_ == 0 ? 0 : least_; }

 private:
  Micros window_us_;
  Micros since_ = 0;
  Micros current_ = 0;  // since then
  Micros least_ = 0;    // of the window before, too
  int count_ = 0;
};

// What follows Cardwell et al., "BBR: congestion-based congestion control" (2016), with frames for
// packets: a round trip is the least that was seen, a rate the most, since whatever disturbs a
// measurement makes it longer and lower. What was sent arrives no sooner than a round trip later
// (there and back), and each frame adds its bytes over the rate; so what a frame took beyond the
// round trip bounds the rate from below, and so does what it and the one in flight before it took.
//
// The viewer is a second stage: it takes `decodeMs` for each frame, one after the other, and
// acknowledges then.
class Link {
 public:
  struct Sent {
    std::uint32_t seq = 0;
    std::size_t bytes = 0;  // with the texts that go before it
    Micros begun = 0;       // to be drawn
    bool moving = false;
  };

  // Goes out now, a ping right before it.
  void sent(const Sent& frame, Micros now);
  // The pong of that ping. Without pongs the round trip is taken from the fastest frame.
  void heard(std::uint32_t seq, Micros now);
  // The kernel has taken the newest frame whole.
  void written(Micros now);
  // Every frame up to that one has been shown.
  void acked(std::uint32_t seq, double decode_ms, Micros now);

  [[nodiscard]] bool known() const { return bytes_per_s() > 0; }
  [[nodiscard]] double bytes_per_s() const;                          // 0 while unknown
  [[nodiscard]] Micros round_trip() const { return trip_.value(); }  // 0 while unknown
  [[nodiscard]] std::size_t bytes_in_flight() const;
  [[nodiscard]] Micros transfer(double bytes) const;  // time on the link alone; 0 while unknown
  // When what is in flight has left the link's narrowest place; long ago if nothing is.
  [[nodiscard]] Micros free_at() const;

  // The earliest moment to begin the next frame such that, when it is ready, it finds the link free
  // and is not there before the viewer can take it; and such that frames follow each other evenly
  // where the credit of two is what limits them. Never later than the last acknowledgement.
  [[nodiscard]] Micros may_start_at() const;

 private:
  struct Flight {
    Sent frame;
    Micros at = 0;  // sent
    // With the frame before, where that was still in flight.
    Micros row_since = 0;
    double row_bytes = 0;
    Micros leaves = 0;  // the narrowest place, as predicted
    Micros done = 0;    // with decoding, less the way there and back
  };

  void predict(Flight& flight, Micros free, Micros idle) const;
  void add_rate(double rate, Micros took);  // bytes/s; of the frame alone

  static constexpr std::size_t rates_kept = 8;
  std::deque<Flight> flights_;  // as many as the credit
  WindowedLeast trip_{10'000'000};
  std::array<double, rates_kept> rates_{};  // bytes/s of the last frames
  std::size_t newest_rate_ = 0;
  double decode_us_ = 0;
  double draw_us_ = 0;  // of a moving frame: from begun to sent
  double moving_bytes_ = 0;
};

}  // namespace windsplat::session
