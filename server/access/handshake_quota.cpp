#include "server/access/handshake_quota.hpp"

namespace windsplat::access {
namespace {

constexpr double handshake_us_per_ms = 1e3;

// 127.0.0.1 and ::1 as counted: health checks of the machine itself use them.
bool is_own_machine(const std::string& address) {
  return address == "127.0.0.1" || address == "::/64";
}

}  // namespace

std::optional<Refusal> HandshakeQuota::may_begin(AddressUsage& usage, bool trusted, Micros now) {
  const auto own_rate = TokenBucket::rate_for_ten_seconds(own_ms_);
  const Micros own_wait = trusted ? 0 : usage.handshakes.wait_for(own_rate, 0, now);
  if (own_wait > 0)
    return Refusal{metrics::LimitKind::handshakes, own_ms_, whole_seconds(own_wait)};
  TokenBucket* const bucket = shared(&usage, trusted);
  if (bucket == nullptr) return std::nullopt;
  const Micros wait = bucket->wait_for(TokenBucket::rate_for_ten_seconds(all_ms_), 0, now);
  if (wait == 0) return std::nullopt;
  return Refusal{metrics::LimitKind::handshakes, all_ms_, whole_seconds(wait)};
}

void HandshakeQuota::took(AddressUsage* usage, bool trusted, Micros took, Micros now) {
  const auto charge = [&](TokenBucket& bucket, double ms_a_second) {
    if (ms_a_second <= 0) return;
    bucket.take(TokenBucket::rate_for_ten_seconds(ms_a_second),
                static_cast<double>(took) / handshake_us_per_ms, now);
  };
  if (usage != nullptr && !trusted) charge(usage->handshakes, own_ms_);
  if (TokenBucket* const bucket = shared(usage, trusted)) charge(*bucket, all_ms_);
}

// Health checks of the machine itself must not wait for unknown addresses: if a limit per address
// is set, only that applies to them.
TokenBucket* HandshakeQuota::shared(const AddressUsage* usage, bool trusted) {
  if (trusted) return &known_;
  if (usage == nullptr) return &strangers_;
  if (own_ms_ > 0 && is_own_machine(usage->address)) return nullptr;
  return usage->authenticated ? &known_ : &strangers_;
}

}  // namespace windsplat::access
