// A token bucket, which refills at a constant rate and may be overdrawn.
#pragma once

#include <cstdint>
#include <optional>

#include "server/access/refusal.hpp"

namespace windsplat::access {

struct TokenBucket {
  using Micros = std::int64_t;  // time of a monotonic clock
  struct Rate {
    double a_second = 0;  // 0: unlimited
    double at_once = 0;
  };
  // With bursts of ten seconds' worth, and at least one token.
  static Rate rate_for_ten_seconds(double a_second);

  void refill(const Rate& rate, Micros now);
  void take(const Rate& rate, double tokens, Micros now);
  // Time until `tokens` tokens are available.
  Micros wait_for(const Rate& rate, double tokens, Micros now);
  // Takes one token if available.
  std::optional<Refusal> take_one(const Rate& rate, metrics::LimitKind kind, double limit,
                                  Micros now);

  double taken = 0;  // after refill; 0 is full
  Micros at = 0;
};

// For Refusal::retry_after_s.
int whole_seconds(TokenBucket::Micros wait);

}  // namespace windsplat::access
