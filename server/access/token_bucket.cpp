#include "server/access/token_bucket.hpp"

#include <algorithm>
#include <cmath>

namespace windsplat::access {
namespace {

constexpr double bucket_us_per_s = 1e6;
constexpr double at_once_s = 10;
constexpr int retry_s_max = 3600;

}  // namespace

TokenBucket::Rate TokenBucket::rate_for_ten_seconds(double a_second) {
  return {a_second, std::max(1.0, at_once_s * a_second)};
}

void TokenBucket::refill(const Rate& rate, Micros now) {
  const double came_back = rate.a_second * static_cast<double>(now - at) / bucket_us_per_s;
  taken = std::max(0.0, taken - came_back);
  at = now;
}

void TokenBucket::take(const Rate& rate, double tokens, Micros now) {
  refill(rate, now);
  taken += tokens;
}

TokenBucket::Micros TokenBucket::wait_for(const Rate& rate, double tokens, Micros now) {
  refill(rate, now);
  const double over = taken + tokens - rate.at_once;
  if (rate.a_second <= 0 || over <= 0) return 0;
  return static_cast<Micros>(std::ceil(over / rate.a_second * bucket_us_per_s));
}

std::optional<Refusal> TokenBucket::take_one(const Rate& rate, metrics::LimitKind kind,
                                             double limit, Micros now) {
  if (rate.a_second <= 0) return std::nullopt;
  const Micros wait = wait_for(rate, 1, now);
  if (wait > 0) return Refusal{kind, limit, whole_seconds(wait)};
  taken += 1;
  return std::nullopt;
}

int whole_seconds(TokenBucket::Micros wait) {
  const double seconds = std::ceil(static_cast<double>(wait) / bucket_us_per_s);
  return static_cast<int>(std::clamp(seconds, 1.0, double{retry_s_max}));
}

}  // namespace windsplat::access
