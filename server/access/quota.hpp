// Current and recent usage of each address as a pure state machine: timed events in, refusals out.
// Owns no socket, lock or clock.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "server/access/address_table.hpp"
#include "server/access/handshake_quota.hpp"
#include "server/access/limits.hpp"
#include "server/access/refusal.hpp"
#include "server/access/token_bucket.hpp"
#include "server/http/rate_limit.hpp"

namespace windsplat::access {

class Quota {
 public:
  using Micros = TokenBucket::Micros;

  // Size of the reserve: connections beyond the limits, which serve health requests only. One
  // address may hold a quarter of it.
  static constexpr std::size_t reserve_max = 64;
  static constexpr std::size_t reserve_per_address = reserve_max / 4;

  explicit Quota(const Limits& limits) : limits_(limits), addresses_(limits), handshakes_(limits) {}

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
  // `trusted`: a proxy, which counts towards the total only.
  Arrival connect(const std::string& address, bool trusted, Micros now);
  // Whether a connection was refused because other addresses fill the reserve.
  [[nodiscard]] bool is_kept_out_by_others(const std::string& address, bool trusted, Micros now);
  void disconnect(const std::string& address, Slot place);  // does not allocate

  std::optional<Refusal> open_session(const std::string& address, Micros now);
  void close_session(const std::string& address);  // does not allocate

  // A parsed request. Health requests have a separate allowance of the same size.
  std::optional<Refusal> request(const std::string& address, bool health, Micros now);
  // Whether a picture may start: quotas of bytes and render time are not exceeded.
  std::optional<Refusal> picture(const std::string& address, Micros now);
  // What the address may still send and receive, for clients; empty without such limits. Requests
  // for health have an allowance of their own.
  std::vector<http::RateLimit> left(const std::string& address, bool health, Micros now);
  // Time until no quota is exceeded.
  Micros throttle_delay(const std::string& address, Micros now);

  void sent(const std::string& address, std::size_t bytes, Micros now);
  void rendered(const std::string& address, Micros took, Micros now);
  // Call before comparing a token: whether recent failures are within the limit.
  std::optional<Refusal> may_try_login(const std::string& address, Micros now);
  // Counts a message of a stream; returns how long to pause reading.
  Micros message_received(const std::string& address, std::size_t bytes, Micros now);
  // Refused above the limit on recent failures; otherwise the failure is only counted.
  std::optional<Refusal> failed_login(const std::string& address, Micros now);

  [[nodiscard]] std::size_t known() const { return addresses_.size(); }
  [[nodiscard]] std::size_t connections() const { return connections_; }

 private:
  Limits limits_;
  AddressTable addresses_;
  HandshakeQuota handshakes_;
  TokenBucket arrivals_;  // of all addresses
  std::size_t connections_ = 0;
  std::size_t reserved_ = 0;
};

}  // namespace windsplat::access
