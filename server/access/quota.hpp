// Current and recent usage of each address as a pure state machine: timed events in, refusals out.
// Owns no socket, lock or clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <string>
#include <unordered_map>

#include "server/access/limits.hpp"
#include "server/metrics/limit_kind.hpp"

namespace windsplat::access {

struct Refusal {
  metrics::LimitKind kind = metrics::LimitKind::connections;
  double limit = 0;       // as in Limits
  int retry_after_s = 1;  // estimated time until admission
};

class Quota {
 public:
  using Micros = std::int64_t;  // of a monotonic clock

  static constexpr std::size_t addresses_max = 4096;  // tracked at a time
  // Size of the reserve: connections above the limits that serve health only. One address may use a
  // quarter of it.
  static constexpr std::size_t reserve_max = 64;
  static constexpr std::size_t reserve_per_address = reserve_max / 4;
  static constexpr double tls_arrivals = 5;  // cost of a handshake in plain connections

  explicit Quota(const Limits& limits) : limits_(limits) {}

  // Decision on a new connection: ordinary, in the reserve (with the reason), or refused.
  enum class Slot { ordinary, reserve, none };
  struct Arrival {
    Slot place = Slot::none;
    std::optional<Refusal> reason;  // set unless ordinary
    bool known = false;             // a proxy, or the address has shown the token
  };
  // Call first for a new connection: whether the rate of recent ones is within the limits.
  std::optional<Refusal> arrive(const std::string& address, bool trusted, bool tls, Micros now);
  // Charges processor time of a TLS handshake. Does not allocate.
  void handshake_took(const std::string& address, bool trusted, Micros took, Micros now);
  // The address has shown the token: until its entry is evicted, its handshakes do not compete with
  // those of unknown addresses.
  void authenticated(const std::string& address, Micros now);
  // `trusted`: of a proxy, which is counted in the total only.
  Arrival connect(const std::string& address, bool trusted, Micros now);
  // Whether it was refused because the reserve is filled by other addresses.
  [[nodiscard]] bool is_kept_out_by_others(const std::string& address, bool trusted, Micros now);
  void disconnect(const std::string& address, Slot place);  // does not allocate

  std::optional<Refusal> open_session(const std::string& address, Micros now);
  void close_session(const std::string& address);  // does not allocate

  // A parsed request. Health requests have a separate allowance of the same size.
  std::optional<Refusal> request(const std::string& address, bool health, Micros now);
  // Whether a picture may start: quotas of bytes and render time are not exceeded.
  std::optional<Refusal> picture(const std::string& address, Micros now);
  // Time until no quota is exceeded.
  Micros throttle_delay(const std::string& address, Micros now);

  void sent(const std::string& address, std::size_t bytes, Micros now);
  void rendered(const std::string& address, Micros took, Micros now);
  // Call before comparing a token: whether recent failures are within the limit.
  std::optional<Refusal> may_try_login(const std::string& address, Micros now);
  // A message of a stream; returns how long to pause reading.
  Micros message_received(const std::string& address, std::size_t bytes, Micros now);
  // Refused above the limit of recent failures; otherwise the failure is only counted.
  std::optional<Refusal> failed_login(const std::string& address, Micros now);

  [[nodiscard]] std::size_t known() const { return entries_.size(); }
  [[nodiscard]] std::size_t connections() const { return connections_; }
  [[nodiscard]] std::size_t reserved() const { return reserved_; }

 private:
  // A token bucket that refills at a constant rate. May be overdrawn.
  struct Rate {
    double a_second = 0;  // 0: unlimited
    double at_once = 0;
  };
  struct Bucket {
    double taken = 0;  // net of refill; 0 is full
    Micros at = 0;
    void refill(const Rate& rate, Micros now);
  };
  struct Entry {
    std::string address;
    std::size_t connections = 0;
    std::size_t reserved = 0;
    std::size_t sessions = 0;
    bool authenticated = false;
    Bucket arrivals, handshakes, requests, health, messages, received, bytes, render, logins;
    Micros seen = 0;
  };
  using Entries = std::list<Entry>;  // least recently seen first

  [[nodiscard]] static Rate rate_for_ten_seconds(double a_second);
  [[nodiscard]] Rate request_rate() const;
  std::optional<Refusal> may_handshake(Entry& entry, bool trusted, Micros now);
  // The bucket for an address's handshakes besides its own; null: none.
  Bucket* shared_handshakes(const Entry* entry, bool trusted);
  [[nodiscard]] Rate byte_rate() const;
  [[nodiscard]] Rate render_rate() const;
  [[nodiscard]] Rate login_rate() const;
  static std::optional<Refusal> take_one(Bucket& bucket, const Rate& rate, metrics::LimitKind kind,
                                         double limit, Micros now);
  static Micros wait_for(Bucket& bucket, const Rate& rate, double room, Micros now);

  // Strong exception guarantee if an allocation fails.
  Entry& entry(const std::string& address, Micros now);
  // For an address with connections or sessions, which has an entry. Does not allocate.
  Entry* known_entry(const std::string& address);
  void forget(Entries::iterator entry);
  void forget_idle(Micros now);
  bool is_idle(Entry& entry, Micros now) const;
  void make_room();

  Limits limits_;
  Entries entries_;
  std::unordered_map<std::string, Entries::iterator> by_address_;
  Bucket arrivals_;  // of all addresses
  Bucket stranger_handshakes_, known_handshakes_;
  std::size_t connections_ = 0;
  std::size_t reserved_ = 0;
};

}  // namespace windsplat::access
