// HTTP over TCP or TLS. The header of a request is read completely, checked as bytes, parsed, and
// refused if necessary before any of the body is read. Bodies need a Content-Length.
#include "server/transport/http_session.hpp"

#include <atomic>
#include <boost/asio/write.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <ctime>
#include <exception>
#include <optional>
#include <string>
#include <utility>

#include "protocol/limits.hpp"
#include "server/access/address.hpp"
#include "server/access/auth.hpp"
#include "server/access/login.hpp"
#include "server/api/routes.hpp"
#include "server/api/services.hpp"
#include "server/http/http_checks.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"
#include "server/transport/guarded.hpp"
#include "server/transport/peer.hpp"
#include "server/transport/post_or_retry.hpp"
#include "server/transport/websocket_session.hpp"
#include "server/transport/wire.hpp"

namespace windsplat::net {
namespace {

namespace http = beast::http;
namespace limits = protocol::limits;
using Clock = std::chrono::steady_clock;

constexpr const char* hsts = "max-age=15552000";  // 180 days; sent over TLS only
constexpr std::size_t buffer_bytes_max = std::size_t{16} * 1024;
constexpr std::chrono::seconds first_timeout{5};  // for a connection's first byte
constexpr std::chrono::seconds idle_timeout{60};  // for the next request of a connection
constexpr std::chrono::seconds drain_idle_timeout{2};
constexpr std::chrono::milliseconds leave_look{40};
constexpr std::chrono::seconds reserve_timeout{2};  // for each phase of a connection of the reserve
constexpr std::chrono::seconds linger_timeout{2};   // for discarding a refused body

std::int64_t micros_since(Clock::time_point since) {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - since).count();
}

bool is_fault_of_text(ErrorCode fault) {
  return fault.category() == ErrorCode(http::error::end_of_stream).category() &&
         fault != http::error::partial_message;
}

class HttpSession : public Connection, public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(Wire wire, Services& services, Connections& connections, Visitor visitor)
      : wire_(std::move(wire)),
        deadline_(wire_.get_executor()),
        services_(services),
        connections_(connections),
        id_(connections.next_id()),
        visitor_(std::move(visitor)),
        leave_timer_(wire_.get_executor()) {}
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
    refuse(problem_response(400, "Bad Request", "this port requires TLS: use https://"));
  }

  void drain() override {
    draining_ = true;
    if (idle_) close();
  }

  void abort() override {
    request_.cancel.cancel();
    close();
  }

  [[nodiscard]] Since idle_since() const override {
    return idle_ && !visitor_.reserve ? Since(waiting_since_) : std::nullopt;
  }
  [[nodiscard]] Since unasked_since() const override {
    const bool unasked = visitor_.reserve && visitor_.place && !asked_;
    return unasked ? Since(came_) : std::nullopt;
  }
  [[nodiscard]] const std::string& request_id() const { return request_.id; }

 private:
  using Parser = http::request_parser<http::string_body>;

  template <class Body>
  auto handler(Body body) {
    return guarded(shared_from_this(), std::move(body));
  }

  // Sets the deadline of the current operation, after which the connection is closed, until the
  // next call or the one below.
  void within(std::chrono::milliseconds time) {
    if (visitor_.reserve) time = std::min<std::chrono::milliseconds>(time, reserve_timeout);
    deadline_.expires_after(time);
    deadline_.async_wait(handler([this](ErrorCode fault) {
      if (!fault && deadline_.expiry() <= Clock::now()) close();
    }));
  }
  void with_no_deadline() { deadline_.expires_at(Clock::time_point::max()); }

  void add(bool late) {
    connections_.add(id_, weak_from_this(), false, late);
    began_ = came_ = Clock::now();
    request_ = blank_request();
  }

  // Charged to the peer until the client address is known.
  [[nodiscard]] Request blank_request() const {
    Request request;
    request.peer = id_;
    request.address = counted_address(visitor_.peer);
    return request;
  }

  // --- reading ----------------------------------------------------------------------------------

  void next_request() {
    request_ = blank_request();
    route_ = route_other;
    is_head_ = false;
    charged_ = quiet_ = false;
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(limits::http_header_bytes_max));
    parser_->body_limit(limits::http_body_bytes_max);
    searched_ = 0;
    if (buffer_.size() > 0) {
      begin_header();
      return;
    }
    idle_ = true;
    waiting_since_ = Clock::now();
    within(services_.draining ? drain_idle_timeout : asked_ ? idle_timeout : first_timeout);
    read_some();
  }

  void begin_header() {
    idle_ = false;
    began_ = Clock::now();
    within(std::chrono::seconds(limits::http_header_timeout_s));
    find_header_end();
  }

  // One read at a time. A read may be pending since a picture was started (watch_for_leaving);
  // buffer_ then stays empty until it completes.
  void read_some() {
    if (reading_) return;
    reading_ = true;
    wire_.async_read_some(
        buffer_.prepare(std::min<std::size_t>(4096, buffer_bytes_max - buffer_.size())),
        handler([this](ErrorCode fault, std::size_t bytes) {
          reading_ = false;
          if (lingering_) return fault ? close() : throw_away();
          if (fault) return on_end();
          buffer_.commit(bytes);
          if (answering_ || sending_) return;  // the client's next request stays in the buffer
          if (idle_) return begin_header();
          find_header_end();
        }));
  }

  // End of stream or a connection error.
  void on_end() {
    if (answering_) return on_left();
    if (!sending_) return close();
    peer_ended_ = true;  // half-closed: it may still read the response
  }

  void find_header_end() {
    const auto data = buffer_.cdata();
    const std::string_view text(static_cast<const char*>(data.data()), data.size());
    const std::size_t end = text.find("\r\n\r\n", searched_);
    const std::size_t length = end == std::string_view::npos ? text.size() : end + 4;
    if (length > limits::http_header_bytes_max) {
      return refuse(problem_response(431, "Request Header Fields Too Large",
                                     "a request's header may have " +
                                         std::to_string(limits::http_header_bytes_max) + " bytes"));
    }
    if (end == std::string_view::npos) {
      searched_ = text.size() < 3 ? 0 : text.size() - 3;
      return read_some();
    }
    if (auto fault = check_header_bytes(text.substr(0, length))) return refuse(std::move(*fault));
    ErrorCode fault;
    buffer_.consume(parser_->put(buffer_.data(), fault));
    if (fault || !parser_->is_header_done()) return refuse_unparsed(fault);
    on_header();
  }

  void refuse_unparsed(ErrorCode fault) {
    if (fault == http::error::body_limit) return refuse(body_too_large());
    if (fault == http::error::header_limit) {
      return refuse(problem_response(431, "Request Header Fields Too Large", fault.message()));
    }
    if (fault == http::error::bad_version) {
      return refuse(problem_response(505, "HTTP Version Not Supported",
                                     "this server speaks HTTP/1.1 and HTTP/1.0"));
    }
    refuse(problem_response(400, "Bad Request", "malformed HTTP request: " + fault.message()));
  }

  void on_header() {
    const auto& message = parser_->get();
    request_.method = std::string(message.method_string());
    is_head_ = request_.method == "HEAD";
    for (const auto& field : message) {
      request_.headers.emplace_back(field.name_string(), field.value());
    }
    if (std::string id = request_.header(request_id_header); is_request_id(id)) {
      request_.id = std::move(id);
    } else {
      request_.id = services_.request_ids.next();
    }
    if (auto fault = check_request(request_, message.version())) return refuse(std::move(*fault));
    if (!is_known_host()) {
      return refuse(problem_response(421, "Misdirected Request",
                                     "unknown host " + printable(request_.header("Host"), 80) +
                                         "; use --allow-host to allow it"));
    }
    if (const auto ok = parse_target(message.target(), services_.options.base_path, request_);
        !ok) {
      return refuse(problem_response(ok.error()));
    }
    charged_ = true;
    if (auto refusal = services_.admission.request(visitor_, request_, names_health(request_))) {
      return refuse(std::move(*refusal));
    }
    const bool upgrade = asks_for_websocket(request_, message.version()) && names_stream(request_);
    if (upgrade) route_ = route_stream;
    const Token* const token = services_.options.token.get();
    if (token != nullptr && shows_token(request_, upgrade)) {
      if (auto over = services_.admission.may_try_login(request_.address)) {
        return refuse(std::move(*over));
      }
    }
    const Verdict verdict = judge(request_, upgrade, token, services_.options.allow_origins,
                                  std::time(nullptr), wire_.secure());
    if (verdict == Verdict::wrong_token) services_.admission.failed_login(request_.address);
    if (verdict != Verdict::allowed) {
      return refuse(turned_away(verdict, request_, services_.options.base_path));
    }
    if (token != nullptr && !names_health(request_) && !is_login(request_)) {
      services_.admission.authenticated(request_.address);
    }
    upgrade ? begin_stream() : read_body();
  }

  [[nodiscard]] bool is_known_host() const {
    const ServerOptions& options = services_.options;
    if (!options.local_hosts_only && !options.known_hosts_only) return true;
    const std::string host = request_.header("Host");
    return local_host_allowed(host, options.allow_origins, options.allow_hosts) ||
           (!options.local_hosts_only && is_address(host));
  }

  void read_body() {
    if (parser_->is_done()) return dispatch();
    within(std::chrono::seconds(limits::http_body_timeout_s));
    // Ignored in HTTP/1.0 (RFC 9110, 10.1.1).
    const bool expects = parser_->get().version() == 11 &&
                         equal_without_case(request_.header("Expect"), "100-continue");
    if (!expects) return read_rest();
    static constexpr std::string_view go_on = "HTTP/1.1 100 Continue\r\n\r\n";
    asio::async_write(wire_, asio::buffer(go_on), handler([this](ErrorCode fault, std::size_t) {
                        if (fault) return close();
                        read_rest();
                      }));
  }

  void read_rest() {
    http::async_read(wire_, buffer_, *parser_, handler([this](ErrorCode fault, std::size_t) {
                       if (fault == http::error::body_limit) return refuse(body_too_large());
                       // Other errors are those of the connection, or its deadline.
                       if (fault && !is_fault_of_text(fault)) return close();
                       if (fault) return refuse_unparsed(fault);
                       dispatch();
                     }));
  }

  // --- answering --------------------------------------------------------------------------------

  void dispatch() {
    asked_ = true;
    request_.body = std::move(parser_->get().body());
    keep_alive_ = parser_->get().keep_alive();
    with_no_deadline();
    if (services_.options.token != nullptr && is_login(request_)) {
      route_ = route_login;
      if (auto over = services_.admission.may_try_login(request_.address)) {
        return send(std::move(*over));
      }
      Response answer = log_in(request_, *services_.options.token, services_.options.base_path,
                               wire_.secure(), std::time(nullptr));
      if (answer.status == 401) services_.admission.failed_login(request_.address);
      return send(std::move(answer));
    }
    answering_ = true;
    watch_for_leaving();
    const auto awaited = std::make_shared<Awaited>(*this);
    route_ = route(services_, request_,
                   [awaited](Response response) { awaited->answer(std::move(response)); });
  }

  // Holds the session weakly: it must not be destroyed on the renderer's thread; its timer
  // (look_for_leaving) keeps it alive while a response is pending. If the work is lost and no
  // response arrives, the connection is closed; if memory is too short to post that, the timer
  // detects it.
  class Awaited {
   public:
    explicit Awaited(HttpSession& session)
        : session_(session.weak_from_this()),
          executor_(session.wire_.get_executor()),
          lost_(session.answer_lost_) {}
    ~Awaited() {
      if (answered_) return;
      try {
        tell([](HttpSession& session) { session.abort(); });
      } catch (const std::exception&) {
        *lost_ = true;
      }
    }
    Awaited(const Awaited&) = delete;
    Awaited& operator=(const Awaited&) = delete;

    void answer(Response response) {
      if (answered_) return;
      answered_ = true;
      tell([response = std::move(response)](HttpSession& session) mutable {
        guarded(session.shared_from_this(), [&] { session.on_reply(std::move(response)); })();
      });
    }

   private:
    template <class Body>
    void tell(Body body) {
      const bool posted =
          post_or_retry(executor_, [weak = session_, body = std::move(body)]() mutable {
            if (const auto session = weak.lock()) body(*session);
          });
      if (!posted) *lost_ = true;
    }

    const std::weak_ptr<HttpSession> session_;
    const asio::any_io_executor executor_;
    const std::shared_ptr<std::atomic<bool>> lost_;
    bool answered_ = false;
  };

  // While a picture is drawn, detect a peer that disconnects. The read continues after the
  // response, since a TLS record must not be abandoned; the data is the next request. Skipped if
  // the next request is already buffered.
  void watch_for_leaving() {
    if (buffer_.size() == 0) read_some();
    look_for_leaving();
  }

  // Unread data, such as a pipelined request, hides the end of stream from a read.
  void look_for_leaving() {
    leave_timer_.expires_after(leave_look);
    leave_timer_.async_wait(handler([this](ErrorCode fault) {
      if (fault || !answering_) return;
      if (*answer_lost_) return abort();
      if (peer_has_left(wire_.next_layer().socket().native_handle())) return on_left();
      look_for_leaving();
    }));
  }

  void on_left() {
    answering_ = false;
    constexpr int client_has_gone = 499;
    services_.metrics.answered(route_, client_has_gone);
    log_access(client_has_gone, 0);
    abort();
  }

  void on_reply(Response response) {
    if (!answering_) return;
    answering_ = false;
    leave_timer_.cancel();
    send(std::move(response));
  }

  // A response after which the connection is closed: the rest of the stream cannot be parsed.
  void refuse(Response response) {
    response.close = true;
    idle_ = false;
    // Requests refused before parsing are charged as well.
    if (!charged_) quiet_ = !services_.admission.count_malformed(visitor_, request_);
    send(std::move(response));
  }

  void send(Response response) {
    keep_alive_ =
        keep_alive_ && !response.close && !draining_ && !services_.draining && !visitor_.reserve;
    if (request_.id.empty()) request_.id = services_.request_ids.next();  // refused before parsing
    name_request(response, request_.id);
    // Applies to every port of the host, and other programs listen on this machine's loopback.
    if (const std::string host = request_.header("Host");
        wire_.secure() && !host.empty() && !names_loopback(host)) {
      response.headers.emplace_back("Strict-Transport-Security", hsts);
    }
    services_.metrics.answered(route_, response.status);
    response_ = std::move(response);
    head_ = response_head(response_, keep_alive_);
    const auto body = is_head_ ? std::span<const std::uint8_t>{} : response_.body.bytes;
    within(write_deadline(body.size(), limits::write_timeout_s));
    sending_ = true;
    const std::array<asio::const_buffer, 2> parts{asio::buffer(head_),
                                                  asio::buffer(body.data(), body.size())};
    asio::async_write(
        wire_, parts,
        handler([this, written_since = Clock::now()](ErrorCode fault, std::size_t bytes) {
          sending_ = false;
          on_sent(bytes, written_since);
          if (fault) return close();
          response_ = Response{};
          if (peer_ended_)
            return close();  // end of stream is reported once: another read would hang
          keep_alive_ && !draining_ ? next_request() : linger();
        }));
  }

  void on_sent(std::size_t bytes, Clock::time_point since) {
    services_.metrics.bytes_sent(Metrics::Over::http, bytes);
    services_.admission.sent(request_.address, bytes);
    if (response_.content_type.starts_with("image/")) {
      services_.metrics.stage_took(Metrics::Stage::write, micros_since(since));
    }
    log_access(response_.status, bytes);
  }

  // Log neither path nor query: they may contain private data.
  void log_access(int status, std::size_t bytes) const {
    if (quiet_) return;
    const std::string_view route = route_;
    const bool often =
        route == "/livez" || route == "/readyz" || route == "/metrics" || route == route_page;
    log::write(often ? log::Level::debug : log::Level::info, "request",
               {{"request", request_.id},
                {"method", request_.method},
                {"route", route},
                {"status", status},
                {"bytes", bytes},
                {"ms", static_cast<double>(micros_since(began_)) / 1000}});
  }

  // Closing with unread bytes resets the connection, and the peer might lose the response.
  void linger() {
    lingering_ = true;
    within(linger_timeout);
    if (!wire_.secure()) return end_sending();
    wire_.say_goodbye(IoHandler(handler([this](ErrorCode, std::size_t) { end_sending(); })));
  }

  void end_sending() {
    ErrorCode ignored;
    wire_.next_layer().socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
    throw_away();
  }

  // Reads from TCP directly: TLS errors no longer matter.
  void throw_away() {
    if (reading_) return;
    reading_ = true;
    buffer_.clear();
    wire_.next_layer().async_read_some(buffer_.prepare(buffer_bytes_max),
                                       handler([this](ErrorCode fault, std::size_t) {
                                         reading_ = false;
                                         if (fault) return close();
                                         throw_away();
                                       }));
  }

  // --- a stream ---------------------------------------------------------------------------------

  void begin_stream() {
    if (!parser_->is_done() || buffer_.size() > 0) {
      return refuse(problem_response(400, "Bad Request", "an upgrade has no body"));
    }
    if (auto fault = check_upgrade(request_)) return refuse(std::move(*fault));
    if (services_.draining) {
      return refuse(
          problem_response(make_error(ErrorKind::draining, "the server is shutting down")));
    }
    auto seat = services_.admission.open_session(request_.address);
    if (seat.refusal) return refuse(std::move(*seat.refusal));
    deadline_.cancel();
    UpgradeRequest message;
    static_cast<http::request_header<>&>(message) = std::move(parser_->get().base());
    // The library parses only the first line of a list header.
    message.set(http::field::connection, "Upgrade");
    message.set(http::field::upgrade, "websocket");
    start_websocket_session(std::move(wire_), std::move(message), request_.id, services_,
                            connections_,
                            {request_.address, std::move(visitor_.place), std::move(seat.place)});
  }

  void close() {
    idle_ = false;
    deadline_.cancel();
    leave_timer_.cancel();
    wire_.close();
    visitor_.place.reset();  // free the place at once
  }

  Wire wire_;
  asio::steady_timer deadline_;
  Services& services_;
  Connections& connections_;
  const std::uint64_t id_;
  Visitor visitor_;
  asio::steady_timer leave_timer_;
  beast::flat_buffer buffer_{buffer_bytes_max};
  std::size_t searched_ = 0;  // bytes of buffer_ already searched for the end of the header
  std::optional<Parser> parser_;
  Request request_;
  const char* route_ = route_other;
  Clock::time_point began_;  // first byte of the request
  Clock::time_point came_;
  Clock::time_point waiting_since_;  // valid if idle_
  Response response_;
  // A response could not be posted to the io thread.
  const std::shared_ptr<std::atomic<bool>> answer_lost_ =
      std::make_shared<std::atomic<bool>>(false);
  std::string head_;
  bool idle_ = false;        // waiting for the first byte of a request
  bool asked_ = false;       // a complete request has arrived
  bool charged_ = false;     // the request was charged to its address
  bool quiet_ = false;       // do not log the request
  bool reading_ = false;     // a read is under way
  bool answering_ = false;   // waiting for a reply
  bool sending_ = false;     // writing a response
  bool peer_ended_ = false;  // end of stream received
  bool lingering_ = false;   // discarding input before closing
  bool is_head_ = false;
  bool keep_alive_ = false;
  bool draining_ = false;
};

}  // namespace

void start_http_session(Wire wire, Services& services, Connections& connections, Visitor visitor,
                        bool late) {
  std::make_shared<HttpSession>(std::move(wire), services, connections, std::move(visitor))
      ->start(late);
}

void refuse_plain_http(Wire wire, Services& services, Connections& connections, Visitor visitor,
                       bool late) {
  std::make_shared<HttpSession>(std::move(wire), services, connections, std::move(visitor))
      ->refuse_plain(late);
}

}  // namespace windsplat::net
