// Who is let in, and what those are told who are not: the quotas of addresses by the clock, as
// answers that say which limit it was.
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

namespace windsplat::net {

// Holds a place among connections or sessions until the last copy goes.
using Ticket = std::shared_ptr<const void>;

// A connection that was taken in.
struct Visitor {
  std::string peer;  // address of the other end
  Ticket place;
  std::optional<Refusal> reserve;  // health alone is answered, and why
  bool trusted = false;            // a proxy, whose connections are those of many clients
  bool known = false;              // one of those, or its address has shown the token
};

// The server is at its limit, or the address is: 503 or 429 with Retry-After.
Response refusal_response(const Refusal& refusal);

// Thread-safe.
class Admission {
 public:
  using Micros = Quota::Micros;

  // `now`: empty is a steady clock.
  Admission(const Limits& limits, Metrics& metrics, std::function<Micros()> now = {});

  // False: too many arrived recently, and it is to be closed without an answer. Before connect().
  // Where handshakes took too much it is logged, once a minute for all.
  bool arrive(const std::string& peer, bool tls);
  // To be called again and again: logs those that were refused since that was logged last.
  void log_refused_handshakes();
  // What steps of a TLS handshake took of a processor; the address as it is counted. Needs no
  // memory.
  void handshake_took(const std::string& address, bool trusted, Micros took);
  // A request showed the token.
  void authenticated(const std::string& address);
  // None: too many, to be closed without an answer.
  std::optional<Visitor> connect(const std::string& peer);

  // Of one that was not: whether a place in the reserve that another gives up would be its.
  bool is_kept_out_by_others(const std::string& peer);

  // Sets request.address to the client's. An answer: it is refused.
  std::optional<Response> request(const Visitor& visitor, Request& request, bool health);
  // A request that was refused before it was understood counts as one all the same. False: there
  // were too many, and this one is not worth a line in the log.
  bool count_malformed(const Visitor& visitor, const Request& request);
  // Whether that address may have a picture drawn.
  std::optional<Response> picture(const std::string& address);
  // A place for a stream, or why there is none.
  struct Seat {
    Ticket place;
    std::optional<Response> refusal;
  };
  Seat open_session(const std::string& address);
  // Whether a token that it shows may be compared: there were not too many wrong ones of late.
  std::optional<Response> may_try_login(const std::string& address);
  // What a wrong token is answered where there were too many of that address; none: as ever.
  std::optional<Response> failed_login(const std::string& address);
  // A message of a stream came: how long nothing more is to be read of it.
  Micros message_received(const std::string& address, std::size_t bytes);
  // How long a stream's next frame has to wait for what its address owes.
  Micros throttle_delay(const std::string& address);

  void sent(const std::string& address, std::size_t bytes);
  void rendered(const std::string& address, Micros took);

  // Both count what is refused.
  Result<void> check(const frame::Cost& cost);
  Result<void> check_estimate(const frame::Cost& cost, double estimate_ms);

 private:
  struct State;
  class Slot;
  [[nodiscard]] std::string client_of(const Visitor& visitor, const Request& request) const;
  std::optional<Response> answer(const std::optional<Refusal>& refusal);

  const Limits limits_;
  std::vector<Network> trusted_;
  Metrics& metrics_;
  std::shared_ptr<State> state_;  // which tickets keep
};

}  // namespace windsplat::net
