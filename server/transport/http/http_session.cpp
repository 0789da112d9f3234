// HTTP over TCP or TLS. The header of a request is read completely, checked as bytes, parsed, and
// refused if necessary before any of the body is read. Bodies need a Content-Length.
#include "server/transport/http/http_session.hpp"

#include <array>
#include <atomic>
#include <boost/asio/write.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/http/read.hpp>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "protocol/limits.hpp"
#include "server/access/address.hpp"
#include "server/access/login.hpp"
#include "server/api/routes.hpp"
#include "server/api/services.hpp"
#include "server/http/http_checks.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"
#include "server/transport/http/awaited_reply.hpp"
#include "server/transport/http/http_gate.hpp"
#include "server/transport/http/http_owner.hpp"
#include "server/transport/http/http_wire.hpp"
#include "server/transport/http/request_parser.hpp"
#include "server/transport/websocket/websocket_session.hpp"
#include "server/transport/wire.hpp"

namespace windsplat::transport {
namespace {

namespace limits = protocol::limits;
using Clock = std::chrono::steady_clock;

constexpr const char* hsts = "max-age=15552000";  // 180 days; sent over TLS only
constexpr std::chrono::seconds first_timeout{5};  // for a connection's first byte
constexpr std::chrono::seconds idle_timeout{60};  // for the next request of a connection
constexpr std::chrono::seconds drain_idle_timeout{2};
constexpr std::chrono::milliseconds leave_look{40};

std::int64_t micros_since(Clock::time_point since) {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - since).count();
}

// One request and its response.
struct CurrentRequest {
  http::Request request;
  const char* route = api::route_other;
  Clock::time_point began;  // first byte of the request
  bool charged = false;     // the request was charged to its address
  bool quiet = false;       // do not log the request
  bool is_head = false;
  bool keep_alive = false;
};

class HttpSession final : public Connection, public HttpOwner {
 public:
  HttpSession(Wire wire, api::Services& services, Connections& connections, access::Visitor visitor)
      : services_(services),
        connections_(connections),
        id_(connections.next_id()),
        visitor_(std::move(visitor)),
        wire_(*this, std::move(wire), visitor_.reserve.has_value()),
        leave_timer_(wire_.wire().get_executor()) {}
  ~HttpSession() override { connections_.remove(id_); }
  HttpSession(const HttpSession&) = delete;
  HttpSession& operator=(const HttpSession&) = delete;

  // The drain waits only for requests already in progress: otherwise a busy client could delay it.
  void start(bool late) {
    add(late);
    next_request();
  }

  void refuse_plain(bool late) {
    add(late);
    refuse(http::problem_response(400, "Bad Request", "this port requires TLS: use https://"));
  }

  void drain() override {
    draining_ = true;
    if (phase_ == Phase::idle) close();
  }

  void abort() override {
    current_.request.cancel.cancel();
    close();
  }

  void close() override {
    if (phase_ == Phase::idle) phase_ = Phase::reading;
    leave_timer_.cancel();
    wire_.close();
    visitor_.place.reset();  // free the place at once
  }

  void on_reply(http::Response response) override {
    if (phase_ != Phase::answering) return;
    phase_ = Phase::reading;
    leave_timer_.cancel();
    send(std::move(response));
  }

  [[nodiscard]] Since idle_since() const override {
    const bool idle = phase_ == Phase::idle;
    return idle && !visitor_.reserve ? Since(waiting_since_) : std::nullopt;
  }
  [[nodiscard]] Since unasked_since() const override {
    const bool unasked = visitor_.reserve && visitor_.place && !asked_;
    return unasked ? Since(came_) : std::nullopt;
  }
  [[nodiscard]] const std::string& request_id() const override { return current_.request.id; }

 private:
  // reading: the request; also before and after a response, and when closing.
  enum class Phase { reading, idle, answering, sending };

  void add(bool late) {
    connections_.add(id_, std::static_pointer_cast<HttpSession>(shared_from_this()), false, late);
    came_ = Clock::now();
    current_ = {blank_request(), api::route_other, came_};
  }

  // Charged to the peer until the client address is known.
  [[nodiscard]] http::Request blank_request() const {
    http::Request request;
    request.peer = id_;
    request.address = access::counted_address(visitor_.peer);
    return request;
  }

  // --- reading ----------------------------------------------------------------------------------

  void next_request() {
    current_ = {blank_request(), api::route_other, current_.began};
    input_.begin();
    if (input_.has_input()) return begin_header();
    phase_ = Phase::idle;
    waiting_since_ = Clock::now();
    wire_.within(services_.draining ? drain_idle_timeout : asked_ ? idle_timeout : first_timeout);
    read_some();
  }

  void begin_header() {
    phase_ = Phase::reading;
    current_.began = Clock::now();
    wire_.within(std::chrono::seconds(limits::http_header_timeout_s));
    find_header_end();
  }

  // A read may be pending since a picture was started (watch_for_leaving); the buffer then stays
  // empty until it completes.
  void read_some() {
    wire_.read_some(input_, [this](ErrorCode fault) {
      if (fault) return on_end();
      if (phase_ == Phase::idle) return begin_header();
      // Otherwise the client's next request stays in the buffer.
      if (phase_ == Phase::reading) find_header_end();
    });
  }

  // End of stream or a connection error.
  void on_end() {
    if (phase_ == Phase::answering) return on_left();
    if (phase_ != Phase::sending) return close();
    peer_ended_ = true;  // half-closed: it may still read the response
  }

  void find_header_end() {
    auto header = input_.parse_header();
    if (!header.complete) return read_some();
    if (header.refusal) return refuse(std::move(*header.refusal));
    on_header();
  }

  void on_header() {
    http::Request& request = current_.request;
    input_.copy_header(request);
    current_.is_head = request.method == "HEAD";
    if (std::string id = request.header(http::request_id_header); http::is_request_id(id)) {
      request.id = std::move(id);
    } else {
      request.id = services_.request_ids.next();
    }
    const auto& message = input_.parser().get();
    if (auto fault = check_form(services_.options, request, message.target(), message.version())) {
      return refuse(std::move(*fault));
    }
    current_.charged = true;
    if (auto refusal = services_.admission.request(visitor_, request, api::names_health(request))) {
      return refuse(std::move(*refusal));
    }
    const bool upgrade =
        http::asks_for_websocket(request, message.version()) && api::names_stream(request);
    if (upgrade) current_.route = api::route_stream;
    if (auto refusal = check_access(services_.options, services_.admission, request, upgrade,
                                    wire_.secure())) {
      return refuse(std::move(*refusal));
    }
    upgrade ? begin_stream() : read_body();
  }

  void read_body() {
    if (input_.parser().is_done()) return dispatch();
    wire_.within(std::chrono::seconds(limits::http_body_timeout_s));
    // Ignored in HTTP/1.0 (RFC 9110, 10.1.1).
    const bool expects =
        input_.parser().get().version() == 11 &&
        http::equal_without_case(current_.request.header("Expect"), "100-continue");
    if (!expects) return read_rest();
    static constexpr std::string_view go_on = "HTTP/1.1 100 Continue\r\n\r\n";
    asio::async_write(wire_.wire(), asio::buffer(go_on),
                      handler([this](ErrorCode fault, std::size_t) {
                        if (fault) return close();
                        read_rest();
                      }));
  }

  void read_rest() {
    beast::http::async_read(wire_.wire(), input_.buffer(), input_.parser(),
                            handler([this](ErrorCode fault, std::size_t) {
                              if (fault == beast::http::error::body_limit)
                                return refuse(http::body_too_large());
                              // Other errors are those of the connection, or its deadline.
                              if (fault && !RequestParser::is_fault_of_text(fault)) return close();
                              if (fault) return refuse(RequestParser::refusal_of(fault));
                              dispatch();
                            }));
  }

  // --- answering --------------------------------------------------------------------------------

  void dispatch() {
    asked_ = true;
    http::Request& request = current_.request;
    request.body = std::move(input_.parser().get().body());
    current_.keep_alive = input_.parser().get().keep_alive();
    wire_.with_no_deadline();
    if (services_.options.token != nullptr && access::is_login(request)) {
      current_.route = api::route_login;
      if (auto over = services_.admission.may_try_login(request.address)) {
        return send(std::move(*over));
      }
      http::Response answer =
          access::log_in(request, *services_.options.token, services_.options.base_path,
                         wire_.secure(), std::time(nullptr));
      if (answer.status == 401) services_.admission.failed_login(request.address);
      return send(std::move(answer));
    }
    phase_ = Phase::answering;
    watch_for_leaving();
    const auto awaited =
        std::make_shared<AwaitedReply>(*this, wire_.wire().get_executor(), answer_lost_);
    current_.route = route(services_, request, [awaited](http::Response response) {
      awaited->answer(std::move(response));
    });
  }

  // While a picture is drawn, detect a peer that disconnects. The read continues after the
  // response, since a TLS record must not be abandoned; the data is the next request. Skipped if
  // the next request is already buffered.
  void watch_for_leaving() {
    if (!input_.has_input()) read_some();
    look_for_leaving();
  }

  // Unread data, such as a pipelined request, hides the end of stream from a read.
  void look_for_leaving() {
    leave_timer_.expires_after(leave_look);
    leave_timer_.async_wait(handler([this](ErrorCode fault) {
      if (fault || phase_ != Phase::answering) return;
      if (*answer_lost_) return abort();
      if (wire_.peer_has_left()) return on_left();
      look_for_leaving();
    }));
  }

  void on_left() {
    phase_ = Phase::reading;
    constexpr int client_has_gone = 499;
    services_.metrics.answered(current_.route, client_has_gone);
    log_access(client_has_gone, 0);
    abort();
  }

  // A response after which the connection is closed: the rest of the stream cannot be parsed.
  void refuse(http::Response response) {
    response.close = true;
    // Requests refused before parsing are charged as well.
    if (!current_.charged) {
      current_.quiet = !services_.admission.count_malformed(visitor_, current_.request);
    }
    send(std::move(response));
  }

  void send(http::Response response) {
    http::Request& request = current_.request;
    current_.keep_alive = current_.keep_alive && !response.close && !draining_ &&
                          !services_.draining && !visitor_.reserve;
    if (request.id.empty()) request.id = services_.request_ids.next();  // refused before parsing
    http::name_request(response, request.id);
    // Applies to every port of the host, and other programs listen on this machine's loopback.
    if (const std::string host = request.header("Host");
        wire_.secure() && !host.empty() && !http::names_loopback(host)) {
      response.headers.emplace_back("Strict-Transport-Security", hsts);
    }
    services_.metrics.answered(current_.route, response.status);
    response_ = std::move(response);
    head_ = http::response_head(response_, current_.keep_alive);
    const auto body = current_.is_head ? std::span<const std::uint8_t>{} : response_.body.bytes;
    wire_.within(write_deadline(body.size(), limits::write_timeout_s));
    phase_ = Phase::sending;
    const std::array<asio::const_buffer, 2> parts{asio::buffer(head_),
                                                  asio::buffer(body.data(), body.size())};
    asio::async_write(
        wire_.wire(), parts,
        handler([this, written_since = Clock::now()](ErrorCode fault, std::size_t bytes) {
          phase_ = Phase::reading;
          on_sent(bytes, written_since);
          if (fault) return close();
          response_ = http::Response{};
          if (peer_ended_)
            return close();  // end of stream is reported once: another read would hang
          current_.keep_alive && !draining_ ? next_request() : wire_.linger(input_);
        }));
  }

  void on_sent(std::size_t bytes, Clock::time_point since) {
    services_.metrics.bytes_sent(metrics::Metrics::Over::http, bytes);
    services_.admission.sent(current_.request.address, bytes);
    if (response_.content_type.starts_with("image/")) {
      services_.metrics.stage_took(metrics::Metrics::Stage::write, micros_since(since));
    }
    log_access(response_.status, bytes);
  }

  // Log neither path nor query: they may contain private data.
  void log_access(int status, std::size_t bytes) const {
    if (current_.quiet) return;
    const std::string_view route = current_.route;
    const bool often =
        route == "/livez" || route == "/readyz" || route == "/metrics" || route == api::route_page;
    log::write(often ? log::Level::debug : log::Level::info, "request",
               {{"request", current_.request.id},
                {"method", current_.request.method},
                {"route", route},
                {"status", status},
                {"bytes", bytes},
                {"ms", static_cast<double>(micros_since(current_.began)) / 1000}});
  }

  // --- a stream ---------------------------------------------------------------------------------

  void begin_stream() {
    const http::Request& request = current_.request;
    if (!input_.parser().is_done() || input_.has_input()) {
      return refuse(http::problem_response(400, "Bad Request", "an upgrade has no body"));
    }
    if (auto fault = http::check_upgrade(request)) return refuse(std::move(*fault));
    if (services_.draining) {
      return refuse(
          http::problem_response(make_error(ErrorKind::draining, "the server is shutting down")));
    }
    auto seat = services_.admission.open_session(request.address);
    if (seat.refusal) return refuse(std::move(*seat.refusal));
    wire_.with_no_deadline();
    UpgradeRequest message;
    static_cast<beast::http::request_header<>&>(message) = std::move(input_.parser().get().base());
    // The library parses only the first line of a list header.
    message.set(beast::http::field::connection, "Upgrade");
    message.set(beast::http::field::upgrade, "websocket");
    start_websocket_session(std::move(wire_.wire()), message, request.id, services_, connections_,
                            {request.address, std::move(visitor_.place), std::move(seat.place)});
  }

  api::Services& services_;
  Connections& connections_;
  const std::uint64_t id_;
  access::Visitor visitor_;
  HttpWire wire_;
  asio::steady_timer leave_timer_;
  RequestParser input_;
  CurrentRequest current_;
  http::Response response_;
  std::string head_;
  // A response could not be posted to the io thread.
  const std::shared_ptr<std::atomic<bool>> answer_lost_ =
      std::make_shared<std::atomic<bool>>(false);
  Clock::time_point came_;
  Clock::time_point waiting_since_;  // valid if idle
  Phase phase_ = Phase::reading;
  bool asked_ = false;       // a complete request has arrived
  bool peer_ended_ = false;  // end of stream received
  bool draining_ = false;
};

}  // namespace

void start_http_session(Wire wire, api::Services& services, Connections& connections,
                        access::Visitor visitor, bool late) {
  std::make_shared<HttpSession>(std::move(wire), services, connections, std::move(visitor))
      ->start(late);
}

void refuse_plain_http(Wire wire, api::Services& services, Connections& connections,
                       access::Visitor visitor, bool late) {
  std::make_shared<HttpSession>(std::move(wire), services, connections, std::move(visitor))
      ->refuse_plain(late);
}

}  // namespace windsplat::transport
