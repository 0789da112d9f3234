// Counters and token buckets of addresses.
#include "server/access/quota.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace windsplat::access {
namespace {

constexpr double quota_us_per_s = 1e6;
constexpr double quota_us_per_ms = 1e3;
constexpr double s_per_minute = 60;
constexpr Quota::Micros forget_after = 600'000'000;
constexpr int quota_retry_s_max = 3600;
// Size of a burst in seconds of the rate.
constexpr double at_once_s = 10;
constexpr double received_at_once_s = 2;

int whole_seconds(Quota::Micros wait) {
  const double seconds = std::ceil(static_cast<double>(wait) / quota_us_per_s);
  return static_cast<int>(std::clamp(seconds, 1.0, double{quota_retry_s_max}));
}

// 127.0.0.1 and ::1 as counted: health checks of the machine itself use them.
bool is_own_machine(const std::string& address) {
  return address == "127.0.0.1" || address == "::/64";
}

bool reached(std::size_t count, std::size_t limit) { return limit > 0 && count >= limit; }

}  // namespace

void Quota::Bucket::refill(const Rate& rate, Micros now) {
  const double came_back = rate.a_second * static_cast<double>(now - at) / quota_us_per_s;
  taken = std::max(0.0, taken - came_back);
  at = now;
}

Quota::Rate Quota::rate_for_ten_seconds(double a_second) {
  return {a_second, std::max(1.0, at_once_s * a_second)};
}
Quota::Rate Quota::request_rate() const {
  return rate_for_ten_seconds(limits_.requests_per_address);
}
Quota::Rate Quota::byte_rate() const {
  return {limits_.bytes_per_address, at_once_s * limits_.bytes_per_address};
}
Quota::Rate Quota::render_rate() const {  // in seconds
  return {limits_.render_s_per_address / s_per_minute, limits_.render_s_per_address};
}
Quota::Rate Quota::login_rate() const {
  const double a_minute = limits_.failed_logins_per_address;
  return {a_minute / s_per_minute, std::max(1.0, a_minute)};
}

Quota::Micros Quota::wait_for(Bucket& bucket, const Rate& rate, double room, Micros now) {
  bucket.refill(rate, now);
  const double over = bucket.taken + room - rate.at_once;
  if (rate.a_second <= 0 || over <= 0) return 0;
  return static_cast<Micros>(std::ceil(over / rate.a_second * quota_us_per_s));
}

std::optional<Refusal> Quota::take_one(Bucket& bucket, const Rate& rate, metrics::LimitKind kind,
                                       double limit, Micros now) {
  if (rate.a_second <= 0) return std::nullopt;
  const Micros wait = wait_for(bucket, rate, 1, now);
  if (wait > 0) return Refusal{kind, limit, whole_seconds(wait)};
  bucket.taken += 1;
  return std::nullopt;
}

std::optional<Refusal> Quota::arrive(const std::string& address, bool trusted, bool tls,
                                     Micros now) {
  const double cost = tls ? tls_arrivals : 1;
  Entry& here = entry(address, now);
  if (tls) {
    if (auto refusal = may_handshake(here, trusted, now)) return refusal;
  }
  Bucket& own = here.arrivals;
  const Rate own_rate = rate_for_ten_seconds(limits_.arrivals_per_address);
  const Rate rate = rate_for_ten_seconds(limits_.arrivals);
  // The cost of one connection never exceeds the size of a burst.
  const Micros own_wait =
      trusted ? 0 : wait_for(own, own_rate, std::min(cost, own_rate.at_once), now);
  if (own_wait > 0) {
    return Refusal{metrics::LimitKind::arrivals, limits_.arrivals_per_address,
                   whole_seconds(own_wait)};
  }
  const Micros wait = wait_for(arrivals_, rate, std::min(cost, rate.at_once), now);
  const bool often = trusted || own_rate.a_second <= 0 || own.taken > own_rate.a_second;
  if (wait > 0 && often) {
    return Refusal{metrics::LimitKind::arrivals, limits_.arrivals, whole_seconds(wait)};
  }
  if (own_rate.a_second > 0 && !trusted) own.taken += cost;
  if (rate.a_second > 0) arrivals_.taken = std::min(arrivals_.taken + cost, rate.at_once);
  return std::nullopt;
}

// May be overdrawn, like bytes and render time: the cost of a handshake is known afterwards.
std::optional<Refusal> Quota::may_handshake(Entry& entry, bool trusted, Micros now) {
  const Rate own_rate = rate_for_ten_seconds(limits_.handshake_ms_per_address);
  const Micros own_wait = trusted ? 0 : wait_for(entry.handshakes, own_rate, 0, now);
  if (own_wait > 0) {
    return Refusal{metrics::LimitKind::handshakes, limits_.handshake_ms_per_address,
                   whole_seconds(own_wait)};
  }
  Bucket* const shared = shared_handshakes(&entry, trusted);
  if (shared == nullptr) return std::nullopt;
  const Micros wait = wait_for(*shared, rate_for_ten_seconds(limits_.handshake_ms), 0, now);
  if (wait == 0) return std::nullopt;
  return Refusal{metrics::LimitKind::handshakes, limits_.handshake_ms, whole_seconds(wait)};
}

// Health checks of the machine itself must not wait for unknown addresses: if a limit per address
// is set, only that applies to them.
Quota::Bucket* Quota::shared_handshakes(const Entry* entry, bool trusted) {
  if (trusted) return &known_handshakes_;
  if (entry == nullptr) return &stranger_handshakes_;
  if (limits_.handshake_ms_per_address > 0 && is_own_machine(entry->address)) return nullptr;
  return entry->authenticated ? &known_handshakes_ : &stranger_handshakes_;
}

void Quota::handshake_took(const std::string& address, bool trusted, Micros took, Micros now) {
  const auto charge = [&](Bucket& bucket, double ms_a_second) {
    if (ms_a_second <= 0) return;
    bucket.refill(rate_for_ten_seconds(ms_a_second), now);
    bucket.taken += static_cast<double>(took) / quota_us_per_ms;
  };
  Entry* const here = known_entry(address);
  if (here != nullptr && !trusted) charge(here->handshakes, limits_.handshake_ms_per_address);
  if (Bucket* const shared = shared_handshakes(here, trusted)) {
    charge(*shared, limits_.handshake_ms);
  }
}

void Quota::authenticated(const std::string& address, Micros now) {
  entry(address, now).authenticated = true;
}

Quota::Arrival Quota::connect(const std::string& address, bool trusted, Micros now) {
  Entry& here = entry(address, now);
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
         (trusted || entry(address, now).reserved < reserve_per_address);
}

void Quota::disconnect(const std::string& address, Slot place) {
  Entry* const here = known_entry(address);
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
  Entry& here = entry(address, now);
  if (reached(here.sessions, limits_.sessions_per_address)) {
    return Refusal{metrics::LimitKind::address_sessions,
                   static_cast<double>(limits_.sessions_per_address)};
  }
  ++here.sessions;
  return std::nullopt;
}

void Quota::close_session(const std::string& address) {
  if (Entry* const here = known_entry(address)) --here->sessions;
}

std::optional<Refusal> Quota::request(const std::string& address, bool health, Micros now) {
  Entry& here = entry(address, now);
  return take_one(health ? here.health : here.requests, request_rate(),
                  metrics::LimitKind::requests, limits_.requests_per_address, now);
}

std::optional<Refusal> Quota::picture(const std::string& address, Micros now) {
  Entry& here = entry(address, now);
  const Micros bytes = wait_for(here.bytes, byte_rate(), 0, now);
  const Micros render = wait_for(here.render, render_rate(), 0, now);
  if (bytes == 0 && render == 0) return std::nullopt;
  if (bytes > render) {
    return Refusal{metrics::LimitKind::bytes, limits_.bytes_per_address, whole_seconds(bytes)};
  }
  return Refusal{metrics::LimitKind::render, limits_.render_s_per_address, whole_seconds(render)};
}

Quota::Micros Quota::throttle_delay(const std::string& address, Micros now) {
  Entry& here = entry(address, now);
  return std::max(wait_for(here.bytes, byte_rate(), 0, now),
                  wait_for(here.render, render_rate(), 0, now));
}

void Quota::sent(const std::string& address, std::size_t bytes, Micros now) {
  if (limits_.bytes_per_address <= 0) return;
  Bucket& bucket = entry(address, now).bytes;
  bucket.refill(byte_rate(), now);
  bucket.taken += static_cast<double>(bytes);
}

void Quota::rendered(const std::string& address, Micros took, Micros now) {
  if (limits_.render_s_per_address <= 0) return;
  Bucket& bucket = entry(address, now).render;
  bucket.refill(render_rate(), now);
  bucket.taken += static_cast<double>(took) / quota_us_per_s;
}

std::optional<Refusal> Quota::may_try_login(const std::string& address, Micros now) {
  const Micros wait = wait_for(entry(address, now).logins, login_rate(), 1, now);
  if (wait == 0) return std::nullopt;
  return Refusal{metrics::LimitKind::logins, limits_.failed_logins_per_address,
                 whole_seconds(wait)};
}

Quota::Micros Quota::message_received(const std::string& address, std::size_t bytes, Micros now) {
  Entry& here = entry(address, now);
  const auto take = [&](Bucket& bucket, double a_second, double much) -> Micros {
    if (a_second <= 0) return 0;
    const Rate rate{a_second, received_at_once_s * a_second};
    bucket.refill(rate, now);
    bucket.taken += much;
    return wait_for(bucket, rate, 0, now);
  };
  return std::max(take(here.messages, limits_.messages_per_address, 1),
                  take(here.received, limits_.received_per_address, static_cast<double>(bytes)));
}

std::optional<Refusal> Quota::failed_login(const std::string& address, Micros now) {
  return take_one(entry(address, now).logins, login_rate(), metrics::LimitKind::logins,
                  limits_.failed_logins_per_address, now);
}

Quota::Entry& Quota::entry(const std::string& address, Micros now) {
  forget_idle(now);
  const auto known = by_address_.find(address);
  if (known == by_address_.end()) {
    if (entries_.size() >= addresses_max) make_room();
    Entries fresh(1);
    fresh.front().address = address;
    by_address_.emplace(address, fresh.begin());
    entries_.splice(entries_.end(), fresh);
  } else {
    entries_.splice(entries_.end(), entries_, known->second);
  }
  Entry& here = entries_.back();
  here.seen = now;
  return here;
}

Quota::Entry* Quota::known_entry(const std::string& address) {
  const auto known = by_address_.find(address);
  return known == by_address_.end() ? nullptr : &*known->second;
}

void Quota::forget(Entries::iterator entry) {
  by_address_.erase(by_address_.find(entry->address));
  entries_.erase(entry);
}

bool Quota::is_idle(Entry& entry, Micros now) const {
  if (entry.connections + entry.reserved + entry.sessions > 0) return false;
  entry.bytes.refill(byte_rate(), now);
  entry.render.refill(render_rate(), now);
  return entry.bytes.taken <= 0 && entry.render.taken <= 0;  // the other buckets refilled long ago
}

// Evict one or two at a time to bound the time of a call.
void Quota::forget_idle(Micros now) {
  for (int n = 0; n < 2 && !entries_.empty(); ++n) {
    Entry& oldest = entries_.front();
    if (now - oldest.seen < forget_after) return;
    if (!is_idle(oldest, now)) {
      oldest.seen = now;
      entries_.splice(entries_.end(), entries_, entries_.begin());
      continue;
    }
    forget(entries_.begin());
  }
}

// Addresses with connections stay: there are fewer of them than entries. Evict unknown addresses
// first, as only they can come in large numbers.
void Quota::make_room() {
  const auto is_away = [](const Entry& known) {
    return known.connections + known.reserved + known.sessions == 0;
  };
  auto oldest = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& known) {
    return is_away(known) && !known.authenticated;
  });
  if (oldest == entries_.end()) oldest = std::find_if(entries_.begin(), entries_.end(), is_away);
  if (oldest != entries_.end()) forget(oldest);
}

}  // namespace windsplat::access
