// A quota behind a mutex; converts refusals to problems.
#include "server/access/admission.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <mutex>
#include <utility>

#include "server/access/cost_limits.hpp"
#include "server/access/identity.hpp"
#include "server/base/log.hpp"
#include "server/http/problem.hpp"

namespace windsplat::access {
namespace {

std::int64_t steady_us() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.15g", value);
  return text.data();
}

std::string detail_of(const Refusal& refusal) {
  const std::string limit = number(refusal.limit);
  switch (refusal.kind) {
    case metrics::LimitKind::connections:
      return "the server has " + limit + " connections, the limit (--max-connections)";
    case metrics::LimitKind::address_connections:
      return "this address has " + limit +
             " connections, the limit (--max-connections-per-address)";
    case metrics::LimitKind::sessions:
      return "the server has " + limit + " sessions, the limit (--max-sessions)";
    case metrics::LimitKind::address_sessions:
      return "this address has " + limit + " sessions, the limit (--max-sessions-per-address)";
    case metrics::LimitKind::requests:
      return "this address may send " + limit + " requests a second (--max-requests-per-address)";
    case metrics::LimitKind::bytes:
      return "this address may receive " + limit + " bytes a second (--max-bytes-per-address)";
    case metrics::LimitKind::render:
      return "this address may have " + limit +
             " seconds of rendering a minute (--max-render-per-address)";
    case metrics::LimitKind::logins:
      return "this address may fail to log in " + limit +
             " times a minute (--max-failed-logins-per-address)";
    case metrics::LimitKind::pixels:
    case metrics::LimitKind::kernels:
    case metrics::LimitKind::waiting:
    case metrics::LimitKind::arrivals:
    case metrics::LimitKind::estimate:
    case metrics::LimitKind::handshakes:
      break;
  }
  return "the server is overloaded; try again";
}

// TLS connections closed because handshakes exceeded their processor time.
struct ClosedHandshakes {
  std::int64_t connections = 0;
  std::string address;  // address of the first one
  bool several = false;
  Admission::Micros since = 0;  // time when the first one was closed; logged as an age
};

void log_closed(const ClosedHandshakes& closed) {
  log::warn(
      "closed connections: TLS handshakes exceeded their processor time (--max-handshakes, "
      "--max-handshakes-per-address)",
      {{"connections", closed.connections},
       {"seconds", closed.since / 1'000'000},
       {"address", closed.address + (closed.several ? " and others" : "")}});
}

}  // namespace

struct Admission::State {
  using Closed = ClosedHandshakes;

  State(const Limits& limits, std::function<Micros()> clock)
      : quota(limits), now(clock ? std::move(clock) : steady_us) {}

  // Both require the mutex. Returns the closures since the last log line; nullopt if that was less
  // than a minute ago.
  std::optional<Closed> count_refused_handshake(const std::string& address, Micros at) {
    if (closed.connections == 0) {
      closed.address = address;
      closed.since = at;
    }
    closed.several = closed.several || closed.address != address;
    ++closed.connections;
    return refused_handshakes(at);
  }
  std::optional<Closed> refused_handshakes(Micros at) {
    constexpr Micros log_every = 60'000'000;
    if (closed.connections == 0 || at < log_next) return std::nullopt;
    log_next = at + log_every;
    closed.since = at - closed.since;
    return std::exchange(closed, {});
  }

  std::mutex mutex;
  Quota quota;
  std::function<Micros()> now;
  Closed closed;
  Micros log_next = std::numeric_limits<Micros>::min();
};

// Releases what was acquired on destruction. Constructed before the acquisition, so that nothing
// can fail in between; destruction does not allocate.
class Admission::Slot {
 public:
  Slot(std::shared_ptr<State> state, std::string address)
      : state_(std::move(state)), address_(std::move(address)) {}
  ~Slot() {
    if (!session_ && connection_ == Quota::Slot::none) return;
    const std::lock_guard lock(state_->mutex);
    if (session_) state_->quota.close_session(address_);
    state_->quota.disconnect(address_, connection_);
  }
  Slot(const Slot&) = delete;
  Slot& operator=(const Slot&) = delete;

  Quota::Arrival connect(bool trusted) {
    const std::lock_guard lock(state_->mutex);
    const auto arrival = state_->quota.connect(address_, trusted, state_->now());
    connection_ = arrival.place;
    return arrival;
  }
  std::optional<Refusal> open_session() {
    const std::lock_guard lock(state_->mutex);
    const auto now = state_->now();
    auto refusal = state_->quota.picture(address_, now);
    if (!refusal) refusal = state_->quota.open_session(address_, now);
    session_ = !refusal;
    return refusal;
  }

 private:
  const std::shared_ptr<State> state_;
  const std::string address_;
  Quota::Slot connection_ = Quota::Slot::none;
  bool session_ = false;
};

http::Response refusal_response(const Refusal& refusal) {
  const bool total = refusal.kind == metrics::LimitKind::connections ||
                     refusal.kind == metrics::LimitKind::sessions;
  return http::problem_response(total ? 503 : 429,
                                total ? "Service Unavailable" : "Too Many Requests",
                                detail_of(refusal), refusal.retry_after_s);
}

Admission::Admission(const Limits& limits, metrics::Metrics& metrics, std::function<Micros()> now)
    : limits_(limits), metrics_(metrics), state_(std::make_shared<State>(limits, std::move(now))) {
  for (const std::string& text : limits.trusted_proxies) {
    if (const auto network = Network::parse(text)) trusted_.push_back(*network);
  }
}

std::optional<http::Response> Admission::answer(const std::optional<Refusal>& refusal) {
  if (!refusal) return std::nullopt;
  metrics_.refused(refusal->kind);
  return refusal_response(*refusal);
}

bool Admission::arrive(const std::string& peer, bool tls) {
  const std::string address = counted_address(peer);
  const bool proxy = is_trusted(peer, trusted_);
  std::optional<Refusal> refusal;
  std::optional<State::Closed> closed;
  {
    const std::lock_guard lock(state_->mutex);
    const Micros now = state_->now();
    refusal = state_->quota.arrive(address, proxy, tls, now);
    if (refusal && refusal->kind == metrics::LimitKind::handshakes) {
      closed = state_->count_refused_handshake(address, now);
    }
  }
  if (refusal) metrics_.refused(refusal->kind);
  if (closed) log_closed(*closed);
  return !refusal;
}

void Admission::log_refused_handshakes() {
  std::optional<State::Closed> closed;
  {
    const std::lock_guard lock(state_->mutex);
    closed = state_->refused_handshakes(state_->now());
  }
  if (closed) log_closed(*closed);
}

void Admission::handshake_took(const std::string& address, bool trusted, Micros took) {
  metrics_.handshake_took(took);
  const std::lock_guard lock(state_->mutex);
  state_->quota.handshake_took(address, trusted, took, state_->now());
}

void Admission::authenticated(const std::string& address) {
  const std::lock_guard lock(state_->mutex);
  state_->quota.authenticated(address, state_->now());
}

std::optional<Visitor> Admission::connect(const std::string& peer) {
  const auto place = std::make_shared<Slot>(state_, counted_address(peer));
  Visitor visitor{peer, place, std::nullopt, is_trusted(peer, trusted_), false};
  const Quota::Arrival arrival = place->connect(visitor.trusted);
  if (arrival.place == Quota::Slot::none) return std::nullopt;
  visitor.reserve = arrival.reason;
  visitor.known = arrival.known;
  return visitor;
}

bool Admission::is_kept_out_by_others(const std::string& peer) {
  const std::string address = counted_address(peer);
  const bool proxy = is_trusted(peer, trusted_);
  const std::lock_guard lock(state_->mutex);
  return state_->quota.is_kept_out_by_others(address, proxy, state_->now());
}

std::string Admission::client_of(const Visitor& visitor, const http::Request& request) const {
  if (visitor.trusted && !limits_.identity_header.empty()) {
    const auto user = named_user(request, limits_.identity_header);
    if (user && !user->empty()) return counted_user(*user);
  }
  return counted_address(client_address(visitor.peer, request.header("X-Forwarded-For"), trusted_));
}

std::optional<http::Response> Admission::request(const Visitor& visitor, http::Request& request,
                                                 bool health) {
  request.address = client_of(visitor, request);
  if (visitor.trusted && !limits_.identity_header.empty()) {
    if (const auto user = named_user(request, limits_.identity_header); !user) {
      count_malformed(visitor, request);
      return http::problem_response(400, "Bad Request", user.error().message);
    }
  }
  if (visitor.reserve && !health) return answer(visitor.reserve);
  std::optional<Refusal> refusal;
  {
    const std::lock_guard lock(state_->mutex);
    refusal = state_->quota.request(request.address, health, state_->now());
  }
  return answer(refusal);
}

std::vector<http::RateLimit> Admission::left(const std::string& address, bool health) {
  const std::lock_guard lock(state_->mutex);
  return state_->quota.left(address, health, state_->now());
}

bool Admission::count_malformed(const Visitor& visitor, const http::Request& request) {
  const std::string address = client_of(visitor, request);
  const std::lock_guard lock(state_->mutex);
  return !state_->quota.request(address, false, state_->now());
}

std::optional<http::Response> Admission::picture(const std::string& address) {
  std::optional<Refusal> refusal;
  {
    const std::lock_guard lock(state_->mutex);
    refusal = state_->quota.picture(address, state_->now());
  }
  return answer(refusal);
}

Admission::Seat Admission::open_session(const std::string& address) {
  const auto place = std::make_shared<Slot>(state_, address);
  if (const auto refusal = place->open_session()) return {nullptr, answer(refusal)};
  return {place, std::nullopt};
}

std::optional<http::Response> Admission::may_try_login(const std::string& address) {
  std::optional<Refusal> refusal;
  {
    const std::lock_guard lock(state_->mutex);
    refusal = state_->quota.may_try_login(address, state_->now());
  }
  return answer(refusal);
}

std::optional<http::Response> Admission::failed_login(const std::string& address) {
  std::optional<Refusal> refusal;
  {
    const std::lock_guard lock(state_->mutex);
    refusal = state_->quota.failed_login(address, state_->now());
  }
  return answer(refusal);
}

Admission::Micros Admission::message_received(const std::string& address, std::size_t bytes) {
  const std::lock_guard lock(state_->mutex);
  return state_->quota.message_received(address, bytes, state_->now());
}

Admission::Micros Admission::throttle_delay(const std::string& address) {
  const std::lock_guard lock(state_->mutex);
  return state_->quota.throttle_delay(address, state_->now());
}

void Admission::sent(const std::string& address, std::size_t bytes) {
  const std::lock_guard lock(state_->mutex);
  state_->quota.sent(address, bytes, state_->now());
}

void Admission::rendered(const std::string& address, Micros took) {
  const std::lock_guard lock(state_->mutex);
  state_->quota.rendered(address, took, state_->now());
}

Result<void> Admission::check(const frame::Cost& cost) {
  auto fits = check_cost(cost, limits_);
  if (!fits) {
    metrics_.refused(fits.error().kind == ErrorKind::too_large ? metrics::LimitKind::pixels
                                                               : metrics::LimitKind::kernels);
  }
  return fits;
}

Result<void> Admission::check_estimate(const frame::Cost& cost, double estimate_ms) {
  const double limit_s = limits_.render_s;
  if (limit_s <= 0 || estimate_ms <= 1000 * limit_s) return {};
  metrics_.refused(metrics::LimitKind::estimate);
  return make_error_at(ErrorKind::invalid, cost.dominant,
                       "dominates the cost of a picture with an estimated time of " +
                           number(std::ceil(estimate_ms / 1000)) + " s; the limit is " +
                           number(limit_s) + " s (--max-render)");
}

}  // namespace windsplat::access
