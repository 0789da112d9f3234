// Estimates round trip and rate from frames sent and acknowledged, and when to start the next one.
#include "server/session/pacing/link.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/limits.hpp"

namespace windsplat::session {
namespace {

// Smaller differences are scheduler noise.
constexpr Micros least_took_us = 500;
// A small excess over the round trip proves that the link is fast, not that it became slow: such
// samples are application-limited.
constexpr Micros clear_took_us = 5'000;
// A long excess counts as several samples: stop flooding a slower link before the usual number of
// frames has confirmed it.
constexpr Micros long_took_us = 100'000;
constexpr Micros counts_most = 4;
constexpr double weight_of_new = 0.5;

double rate_of(double bytes, Micros took) {
  return 1e6 * bytes / static_cast<double>(std::max(took, least_took_us));
}

void smooth(double& value, double sample) {
  value = value > 0 ? value + weight_of_new * (sample - value) : sample;
}

}  // namespace

void WindowedLeast::add(Micros value, Micros now) {
  if (count_ == 0) {
    least_ = current_ = value;
    since_ = now;
    count_ = 1;
  } else if (now - since_ >= window_us_) {
    least_ = std::min(current_, value);
    current_ = value;
    since_ = now;
  } else {
    current_ = std::min(current_, value);
    least_ = std::min(least_, value);
  }
}

void Link::sent(const Sent& frame, Micros now) {
  Flight flight{frame, now, now, static_cast<double>(frame.bytes)};
  if (flights_.empty()) {
    predict(flight, 0, 0);
  } else {
    const Flight& before = flights_.back();
    flight.row_since = before.at;
    flight.row_bytes += static_cast<double>(before.frame.bytes);
    predict(flight, before.leaves, before.done);
  }
  flights_.push_back(flight);
  if (!frame.moving) return;
  smooth(draw_us_, static_cast<double>(std::max<Micros>(now - frame.begun, 1)));
  smooth(moving_bytes_, static_cast<double>(frame.bytes));
}

void Link::answered(std::uint32_t seq, Micros now) {
  for (const Flight& flight : flights_) {
    if (flight.frame.seq == seq) trip_.add(now - flight.at, now);
  }
}

void Link::written(Micros now) {
  if (flights_.empty()) return;
  Flight& newest = flights_.back();
  newest.leaves = std::max(newest.leaves, now);
  newest.done = std::max(newest.done, newest.leaves);
}

void Link::acked(std::uint32_t seq, double decode_ms, Micros now) {
  Flight newest;
  while (!flights_.empty() && flights_.front().frame.seq <= seq) {
    newest = flights_.front();
    flights_.pop_front();
  }
  if (newest.frame.bytes == 0) return;
  const auto reported = static_cast<Micros>(1000 * std::clamp(decode_ms, 0.0, 1e6));
  const Micros decode = std::min(reported, now - newest.at);
  smooth(decode_us_, static_cast<double>(decode));
  const Micros arrived = now - decode;  // time at which the acknowledgement of an instantly decoded
                                        // frame would arrive
  trip_.add(arrived - newest.at, now);
  const Micros alone = arrived - newest.at - round_trip();
  const Micros in_row = arrived - newest.row_since - round_trip();
  // The fastest frame itself has no excess over the round trip.
  if (alone > 0) {
    add_rate(std::max(rate_of(static_cast<double>(newest.frame.bytes), alone),
                      rate_of(newest.row_bytes, in_row)),
             alone);
  }
  // Update the prediction for frames in flight.
  Micros free = arrived - round_trip();
  Micros idle = now - round_trip();
  for (Flight& flight : flights_) {
    predict(flight, free, idle);
    free = flight.leaves;
    idle = flight.done;
  }
}

void Link::predict(Flight& flight, Micros free, Micros idle) const {
  flight.leaves = std::max(flight.at, free) + transfer(static_cast<double>(flight.frame.bytes));
  flight.done = std::max(flight.leaves, idle) + static_cast<Micros>(decode_us_);
}

void Link::add_rate(double rate, Micros took) {
  if (took < clear_took_us && rate <= bytes_per_s()) return;
  const auto count = std::clamp<Micros>(took / long_took_us, 1, counts_most);
  for (Micros n = 0; n < count; ++n) {
    newest_rate_ = (newest_rate_ + 1) % rates_kept;
    rates_[newest_rate_] = rate;
  }
}

double Link::bytes_per_s() const { return *std::max_element(rates_.begin(), rates_.end()); }

std::size_t Link::bytes_in_flight() const {
  std::size_t sum = 0;
  for (const Flight& flight : flights_) sum += flight.frame.bytes;
  return sum;
}

Micros Link::transfer(double bytes) const {
  const double rate = bytes_per_s();
  return rate > 0 ? static_cast<Micros>(std::min(1e6 * bytes / rate, 1e9)) : 0;
}

Micros Link::free_at() const { return flights_.empty() ? 0 : flights_.back().leaves; }

Micros Link::may_start_at() const {
  if (flights_.empty() || !known()) return 0;
  const Flight& last = flights_.back();
  const auto draw = static_cast<Micros>(draw_us_);
  const Micros moved = transfer(moving_bytes_);
  const Micros cycle = draw + moved + round_trip() + static_cast<Micros>(decode_us_);
  // Slightly early: an overestimate must not cost frames.
  const Micros even = cycle * 9 / (10 * Micros{protocol::limits::frames_in_flight_max});
  return std::max({last.leaves - draw, last.done - moved - draw, last.frame.begun + even});
}

}  // namespace windsplat::session
