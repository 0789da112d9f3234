// Counters and token buckets of addresses.
#include "server/access/quota.hpp"

#include <algorithm>
#include <cmath>

namespace windsplat::access {
namespace {

using Rate = TokenBucket::Rate;

constexpr double quota_us_per_s = 1e6;
constexpr double tls_arrivals = 5;  // cost of a handshake in plain connections
constexpr double s_per_minute = 60;
constexpr double received_at_once_s = 2;  // size of a burst in seconds of the rate

// The state of a bucket that holds ten seconds' worth.
http::RateLimit left_of(const char* name, TokenBucket& bucket, const Rate& rate, const char* unit,
                        Quota::Micros now) {
  static constexpr double integer_max =
      999'999'999'999'999;  // of structured fields (RFC 9651, 3.3.1)
  const auto whole = [](double value) {
    return static_cast<std::int64_t>(std::clamp(value, 0.0, integer_max));
  };
  bucket.refill(rate, now);
  return {name,
          whole(rate.at_once),
          whole(std::ceil(rate.at_once / rate.a_second)),
          whole(rate.at_once - bucket.taken),
          whole(std::ceil(bucket.taken / rate.a_second)),
          unit};
}

bool reached(std::size_t count, std::size_t limit) { return limit > 0 && count >= limit; }

Rate login_rate(const Limits& limits) {
  const double a_minute = limits.failed_logins_per_address;
  return {a_minute / s_per_minute, std::max(1.0, a_minute)};
}

}  // namespace

std::optional<Refusal> Quota::arrive(const std::string& address, bool trusted, bool tls,
                                     Micros now) {
  const double cost = tls ? tls_arrivals : 1;
  AddressUsage& here = addresses_.entry(address, now);
  if (tls) {
    if (auto refusal = handshakes_.may_begin(here, trusted, now)) return refusal;
  }
  TokenBucket& own = here.arrivals;
  const Rate own_rate = TokenBucket::rate_for_ten_seconds(limits_.arrivals_per_address);
  const Rate rate = TokenBucket::rate_for_ten_seconds(limits_.arrivals);
  // The cost of one connection never exceeds the size of a burst.
  const Micros own_wait =
      trusted ? 0 : own.wait_for(own_rate, std::min(cost, own_rate.at_once), now);
  if (own_wait > 0) {
    return Refusal{metrics::LimitKind::arrivals, limits_.arrivals_per_address,
                   whole_seconds(own_wait)};
  }
  const Micros wait = arrivals_.wait_for(rate, std::min(cost, rate.at_once), now);
  const bool often = trusted || own_rate.a_second <= 0 || own.taken > own_rate.a_second;
  if (wait > 0 && often) {
    return Refusal{metrics::LimitKind::arrivals, limits_.arrivals, whole_seconds(wait)};
  }
  if (own_rate.a_second > 0 && !trusted) own.taken += cost;
  if (rate.a_second > 0) arrivals_.taken = std::min(arrivals_.taken + cost, rate.at_once);
  return std::nullopt;
}

void Quota::handshake_took(const std::string& address, bool trusted, Micros took, Micros now) {
  handshakes_.took(addresses_.find(address), trusted, took, now);
}

void Quota::authenticated(const std::string& address, Micros now) {
  addresses_.entry(address, now).authenticated = true;
}

Quota::Arrival Quota::connect(const std::string& address, bool trusted, Micros now) {
  AddressUsage& here = addresses_.entry(address, now);
  const bool known = trusted || here.authenticated;
  std::optional<Refusal> reason;
  if (reached(connections_, limits_.connections)) {
    reason = Refusal{metrics::LimitKind::connections, static_cast<double>(limits_.connections)};
  } else if (!trusted && reached(here.connections, limits_.connections_per_address)) {
    reason = Refusal{metrics::LimitKind::address_connections,
                     static_cast<double>(limits_.connections_per_address)};
  }
  if (!reason) {
    ++connections_;
    ++here.connections;
    return {Slot::ordinary, std::nullopt, known};
  }
  const bool too_many_of_it = !trusted && here.reserved >= reserve_per_address;
  if (reserved_ >= reserve_max || too_many_of_it) return {Slot::none, reason, known};
  ++reserved_;
  ++here.reserved;
  return {Slot::reserve, reason, known};
}

bool Quota::is_kept_out_by_others(const std::string& address, bool trusted, Micros now) {
  return reserved_ >= reserve_max &&
         (trusted || addresses_.entry(address, now).reserved < reserve_per_address);
}

void Quota::disconnect(const std::string& address, Slot place) {
  AddressUsage* const here = addresses_.find(address);
  if (here == nullptr) return;
  if (place == Slot::ordinary) {
    --connections_;
    --here->connections;
  } else if (place == Slot::reserve) {
    --reserved_;
    --here->reserved;
  }
}

std::optional<Refusal> Quota::open_session(const std::string& address, Micros now) {
  AddressUsage& here = addresses_.entry(address, now);
  if (reached(here.sessions, limits_.sessions_per_address)) {
    return Refusal{metrics::LimitKind::address_sessions,
                   static_cast<double>(limits_.sessions_per_address)};
  }
  ++here.sessions;
  return std::nullopt;
}

void Quota::close_session(const std::string& address) {
  if (AddressUsage* const here = addresses_.find(address)) --here->sessions;
}

std::optional<Refusal> Quota::request(const std::string& address, bool health, Micros now) {
  AddressUsage& here = addresses_.entry(address, now);
  TokenBucket& bucket = health ? here.health : here.requests;
  return bucket.take_one(TokenBucket::rate_for_ten_seconds(limits_.requests_per_address),
                         metrics::LimitKind::requests, limits_.requests_per_address, now);
}

std::optional<Refusal> Quota::picture(const std::string& address, Micros now) {
  AddressUsage& here = addresses_.entry(address, now);
  const Micros bytes = here.bytes.wait_for(addresses_.byte_rate(), 0, now);
  const Micros render = here.render.wait_for(addresses_.render_rate(), 0, now);
  if (bytes == 0 && render == 0) return std::nullopt;
  if (bytes > render) {
    return Refusal{metrics::LimitKind::bytes, limits_.bytes_per_address, whole_seconds(bytes)};
  }
  return Refusal{metrics::LimitKind::render, limits_.render_s_per_address, whole_seconds(render)};
}

std::vector<http::RateLimit> Quota::left(const std::string& address, bool health, Micros now) {
  std::vector<http::RateLimit> limits;
  if (limits_.requests_per_address <= 0 && limits_.bytes_per_address <= 0) return limits;
  AddressUsage& here = addresses_.entry(address, now);
  if (limits_.requests_per_address > 0) {
    limits.push_back(left_of("requests", health ? here.health : here.requests,
                             TokenBucket::rate_for_ten_seconds(limits_.requests_per_address), "",
                             now));
  }
  if (limits_.bytes_per_address > 0) {
    limits.push_back(left_of("bytes", here.bytes, addresses_.byte_rate(), "content-bytes", now));
  }
  return limits;
}

Quota::Micros Quota::throttle_delay(const std::string& address, Micros now) {
  AddressUsage& here = addresses_.entry(address, now);
  return std::max(here.bytes.wait_for(addresses_.byte_rate(), 0, now),
                  here.render.wait_for(addresses_.render_rate(), 0, now));
}

void Quota::sent(const std::string& address, std::size_t bytes, Micros now) {
  if (limits_.bytes_per_address <= 0) return;
  addresses_.entry(address, now)
      .bytes.take(addresses_.byte_rate(), static_cast<double>(bytes), now);
}

void Quota::rendered(const std::string& address, Micros took, Micros now) {
  if (limits_.render_s_per_address <= 0) return;
  const double seconds = static_cast<double>(took) / quota_us_per_s;
  addresses_.entry(address, now).render.take(addresses_.render_rate(), seconds, now);
}

std::optional<Refusal> Quota::may_try_login(const std::string& address, Micros now) {
  const Micros wait = addresses_.entry(address, now).logins.wait_for(login_rate(limits_), 1, now);
  if (wait == 0) return std::nullopt;
  return Refusal{metrics::LimitKind::logins, limits_.failed_logins_per_address,
                 whole_seconds(wait)};
}

Quota::Micros Quota::message_received(const std::string& address, std::size_t bytes, Micros now) {
  AddressUsage& here = addresses_.entry(address, now);
  const auto take = [&](TokenBucket& bucket, double a_second, double much) -> Micros {
    if (a_second <= 0) return 0;
    const Rate rate{a_second, received_at_once_s * a_second};
    bucket.take(rate, much, now);
    return bucket.wait_for(rate, 0, now);
  };
  return std::max(take(here.messages, limits_.messages_per_address, 1),
                  take(here.received, limits_.received_per_address, static_cast<double>(bytes)));
}

std::optional<Refusal> Quota::failed_login(const std::string& address, Micros now) {
  return addresses_.entry(address, now)
      .logins.take_one(login_rate(limits_), metrics::LimitKind::logins,
                       limits_.failed_logins_per_address, now);
}

}  // namespace windsplat::access
