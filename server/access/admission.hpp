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

// Holds a slot among connections or sessions until the last copy is destroyed.
using Ticket = std::shared_ptr<const void>;

// An admitted connection.
struct Visitor {
  std::string peer;  // remote address
  Ticket place;
  std::optional<Refusal> reserve;  // reason why only health requests are served
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

  // Returns false if there are too many recent connections: close it without a response. Call
  // before connect(). Excess handshake time is logged at most once a minute.
  bool arrive(const std::string& peer, bool tls);
  // Call periodically: logs refusals since the last log line.
  void log_refused_handshakes();
  // Charges processor time of a TLS handshake to the address. Does not allocate memory.
  void handshake_took(const std::string& address, bool trusted, Micros took);
  // Records that a request has shown the token.
  void authenticated(const std::string& address);
  // Returns nullopt at the limit: close the connection without a response.
  std::optional<Visitor> connect(const std::string& peer);

  // Whether a connection in the reserve would be admitted if a slot of the reserve were freed.
  bool is_kept_out_by_others(const std::string& peer);

  // Sets request.address to the address of the client, or to the user that a proxy names
  // (identity.hpp). Returns a response if the request is refused.
  std::optional<http::Response> request(const Visitor& visitor, http::Request& request,
                                        bool health);
  // What the client may still send and receive, for the answer to it (Quota::left).
  std::vector<http::RateLimit> left(const std::string& address, bool health);
  // Counts a request refused before parsing. False: too many recently, so do not log this one.
  bool count_malformed(const Visitor& visitor, const http::Request& request);
  // Whether a picture may be drawn for the address.
  std::optional<http::Response> picture(const std::string& address);
  // A slot for a stream, or the refusal.
  struct Seat {
    Ticket place;
    std::optional<http::Response> refusal;
  };
  Seat open_session(const std::string& address);
  // Whether a token may be compared: the number of recent failures is within the limit.
  std::optional<http::Response> may_try_login(const std::string& address);
  // The response to a wrong token beyond the limit on failures; nullopt: the usual one.
  std::optional<http::Response> failed_login(const std::string& address);
  // Counts a message of a stream; returns how long to pause reading.
  Micros message_received(const std::string& address, std::size_t bytes);
  // Delay of a stream's next frame until the address is within its quota.
  Micros throttle_delay(const std::string& address);

  void sent(const std::string& address, std::size_t bytes);
  void rendered(const std::string& address, Micros took);

  // Both functions count refusals.
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
  std::shared_ptr<State> state_;  // shared with the slots
};

}  // namespace windsplat::access
