// Admission control: applies the quotas of addresses in real time; refusals are responses that name
// the limit.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/access/address.hpp"
#include "server/access/quota.hpp"
#include "server/frame/cost.hpp"
#include "server/http/exchange.hpp"
#include "server/metrics/metrics.hpp"

namespace windsplat::access {

// Holds a place among connections or sessions until the last copy is destroyed.
using Ticket = std::shared_ptr<const void>;

// An admitted connection.
struct Visitor {
  std::string peer;  // remote address
  Ticket place;
  std::optional<Refusal> reserve;  // only health is served, for this reason
  bool trusted = false;            // a proxy, which has connections of many clients
  bool known = false;              // a proxy, or the address has shown the token
};

// The server or the address is at its limit: 503 or 429 with Retry-After.
http::Response refusal_response(const Refusal& refusal);

// Thread-safe.
class Admission {
 public:
  using Micros = Quota::Micros;

  // `now`: clock in microseconds; empty: a steady clock.
  Admission(const Limits& limits, metrics::Metrics& metrics, std::function<Micros()> now = {});

  // False: too many recent connections; close it without a response. Call before connect(). Excess
  // handshake time is logged at most once a minute.
  bool arrive(const std::string& peer, bool tls);
  // Call periodically: logs refusals since the last log line.
  void log_refused_handshakes();
  // Charges processor time of a TLS handshake to the address. Does not allocate.
  // memory.
  void handshake_took(const std::string& address, bool trusted, Micros took);
  // A request has shown the token.
  void authenticated(const std::string& address);
  // None: at the limit; close without a response.
  std::optional<Visitor> connect(const std::string& peer);

  // For a refused one: whether a place freed in the reserve would admit it.
  bool is_kept_out_by_others(const std::string& peer);

  // Sets request.address to the client's. A value: the request is refused with it.
  std::optional<http::Response> request(const Visitor& visitor, http::Request& request,
                                        bool health);
  // Counts a request refused before parsing. False: too many, do not log this one.
  // were too many, and this one is not worth a line in the log.
  bool count_malformed(const Visitor& visitor, const http::Request& request);
  // Whether the address may have a picture drawn.
  std::optional<http::Response> picture(const std::string& address);
  // A place for a stream, or the refusal.
  struct Seat {
    Ticket place;
    std::optional<http::Response> refusal;
  };
  Seat open_session(const std::string& address);
  // Whether a token may be compared: the number of recent failures is within the limit.
  std::optional<http::Response> may_try_login(const std::string& address);
  // The response to a wrong token above the limit of failures; none: the usual one.
  std::optional<http::Response> failed_login(const std::string& address);
  // Counts a message of a stream; returns how long to pause reading.
  Micros message_received(const std::string& address, std::size_t bytes);
  // Delay of a stream's next frame until the address is within its quota.
  Micros throttle_delay(const std::string& address);

  void sent(const std::string& address, std::size_t bytes);
  void rendered(const std::string& address, Micros took);

  // Both count refusals.
  Result<void> check(const frame::Cost& cost);
  Result<void> check_estimate(const frame::Cost& cost, double estimate_ms);

 private:
  struct State;
  class Slot;
  [[nodiscard]] std::string client_of(const Visitor& visitor, const http::Request& request) const;
  std::optional<http::Response> answer(const std::optional<Refusal>& refusal);

  const Limits limits_;
  std::vector<Network> trusted_;
  metrics::Metrics& metrics_;
  std::shared_ptr<State> state_;  // shared with tickets
};

}  // namespace windsplat::access
