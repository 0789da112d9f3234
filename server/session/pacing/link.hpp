// Estimate of the link to a client from send and acknowledgement times of frames.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

namespace windsplat::session {

using Micros = std::int64_t;  // microseconds of a monotonic clock

// Minimum over the last one to two `window_us`.
class WindowedLeast {
 public:
  explicit WindowedLeast(Micros window_us) : window_us_(window_us) {}
  void add(Micros value, Micros now);
  [[nodiscard]] bool known() const { return count_ > 0; }
  [[nodiscard]] Micros value() const { return count_ == 0 ? 0 : least_; }

 private:
  Micros window_us_;
  Micros since_ = 0;
  Micros current_ = 0;  // minimum of the window begun at since_
  Micros least_ = 0;    // including the previous window
  int count_ = 0;
};

// Follows Cardwell et al., "BBR: congestion-based congestion control" (2016), with frames for
// packets: the round trip is the minimum observed and the rate the maximum, since disturbances only
// lengthen and slow measurements. Data arrives no sooner than a round trip after sending (there and
// back), and each frame adds its bytes over the rate; the excess of a frame over the round trip,
// alone or with the frame in flight before it, is a lower bound on the rate.
//
// The client is a second stage: it takes `decodeMs` per frame, one after the other, and then
// acknowledges.
class Link {
 public:
  struct Sent {
    std::uint32_t seq = 0;
    std::size_t bytes = 0;  // including preceding text messages
    Micros begun = 0;       // start of its render
    bool moving = false;
  };

  // Records a frame that is sent now, directly after a ping.
  void sent(const Sent& frame, Micros now);
  // Records the pong of that ping. Without pongs the round trip is that of the fastest frame.
  void answered(std::uint32_t seq, Micros now);
  // Records that the kernel has accepted the newest frame completely.
  void written(Micros now);
  // Records that every frame up to that one has been shown.
  void acked(std::uint32_t seq, double decode_ms, Micros now);

  [[nodiscard]] bool known() const { return bytes_per_s() > 0; }
  [[nodiscard]] double bytes_per_s() const;                          // 0 while unknown
  [[nodiscard]] Micros round_trip() const { return trip_.value(); }  // 0 while unknown
  [[nodiscard]] std::size_t bytes_in_flight() const;
  [[nodiscard]] Micros transfer(double bytes) const;  // transfer time without queueing; 0 while
                                                      // unknown
  // Time when the data in flight have passed the bottleneck; in the past if there are none.
  [[nodiscard]] Micros free_at() const;

  // Earliest time to start the next frame such that the link is idle and the client ready once it
  // is encoded, and frames are evenly spaced if the credit of two is the limit. Never later than
  // the last acknowledgement.
  [[nodiscard]] Micros may_start_at() const;

 private:
  struct Flight {
    Sent frame;
    Micros at = 0;  // time of sending
    // Together with the previous frame, if that was in flight.
    Micros row_since = 0;
    double row_bytes = 0;
    Micros leaves = 0;  // predicted time at the bottleneck
    Micros done = 0;    // including decoding, less the round trip
  };

  void predict(Flight& flight, Micros free, Micros idle) const;
  void add_rate(double rate, Micros took);  // bytes/s of the single frame

  static constexpr std::size_t rates_kept = 8;
  std::deque<Flight> flights_;  // bounded by the credit
  WindowedLeast trip_{10'000'000};
  std::array<double, rates_kept> rates_{};  // bytes/s of the last frames
  std::size_t newest_rate_ = 0;
  double decode_us_ = 0;
  double draw_us_ = 0;  // time of a moving frame from start to send
  double moving_bytes_ = 0;
};

}  // namespace windsplat::session
