// The HTTP edge. A request's header is read to its end, looked at as bytes, parsed, and refused
// before any of its body is read. Bodies come by Content-Length alone.
#include "server/net/http_session.hpp"

#include <sys/socket.h>

#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <optional>
#include <string>
#include <utility>

#include "protocol/limits.hpp"
#include "server/net/http_checks.hpp"
#include "server/net/negotiate.hpp"
#include "server/net/problem.hpp"
#include "server/net/stream.hpp"
#include "server/net/target.hpp"
#include "server/net/websocket_session.hpp"

namespace windsplat::net {
namespace {

namespace http = beast::http;
namespace limits = protocol::limits;

constexpr std::size_t buffer_bytes_max = std::size_t{16} * 1024;
constexpr std::chrono::seconds idle_timeout{60};  // for the next request of a connection
constexpr std::chrono::seconds drain_idle_timeout{2};
constexpr std::chrono::seconds linger_timeout{2};  // for a refused body to be thrown away

class HttpSession : public Connection, public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(asio::ip::tcp::socket socket, Services& services, Connections& connections)
      : stream_(std::move(socket)),
        services_(services),
        connections_(connections),
        id_(connections.next_id()) {}
  ~HttpSession() override { connections_.remove(id_); }
  HttpSession(const HttpSession&) = delete;
  HttpSession& operator=(const HttpSession&) = delete;

  void start() {
    connections_.add(id_, weak_from_this(), false);
    next_request();
  }

  void drain() override {
    draining_ = true;
    if (idle_) close();
  }

  void abort() override {
    request_.cancel.cancel();
    close();
  }

 private:
  using Parser = http::request_parser<http::string_body>;

  template <class Body>
  auto handler(Body body) {
    return guarded(shared_from_this(), std::move(body));
  }

  // --- reading ----------------------------------------------------------------------------------

  void next_request() {
    request_ = Request{};
    request_.peer = id_;
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(limits::http_header_bytes_max));
    parser_->body_limit(limits::http_body_bytes_max);
    searched_ = 0;
    if (buffer_.size() > 0) {
      begin_header();
      return;
    }
    idle_ = true;
    stream_.expires_after(services_.draining ? drain_idle_timeout : idle_timeout);
    read_some();
  }

  void begin_header() {
    idle_ = false;
    stream_.expires_after(std::chrono::seconds(limits::http_header_timeout_s));
    find_header_end();
  }

  void read_some() {
    stream_.async_read_some(
        buffer_.prepare(std::min<std::size_t>(4096, buffer_bytes_max - buffer_.size())),
        handler([this](ErrorCode fault, std::size_t bytes) {
          if (fault) return close();
          buffer_.commit(bytes);
          if (idle_) return begin_header();
          find_header_end();
        }));
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
    refuse(problem_response(400, "Bad Request", "the request is no HTTP: " + fault.message()));
  }

  void on_header() {
    const auto& message = parser_->get();
    request_.method = std::string(message.method_string());
    is_head_ = request_.method == "HEAD";
    for (const auto& field : message) {
      request_.headers.emplace_back(field.name_string(), field.value());
    }
    if (auto fault = check_request(request_, message.version())) return refuse(std::move(*fault));
    if (services_.options.local_hosts_only &&
        !local_host_allowed(request_.header("Host"), services_.options.allow_origins)) {
      return refuse(problem_response(
          421, "Misdirected Request",
          "this server listens on loopback alone and does not answer for the host " +
              printable(request_.header("Host"), 80) + "; --allow-origin names further ones"));
    }
    if (const auto ok = parse_target(message.target(), services_.options.base_path, request_);
        !ok) {
      return refuse(problem_response(ok.error()));
    }
    if (beast::websocket::is_upgrade(message) && names_stream(request_)) return upgrade();
    read_body();
  }

  void read_body() {
    if (parser_->is_done()) return dispatch();
    stream_.expires_after(std::chrono::seconds(limits::http_body_timeout_s));
    if (!equal_without_case(request_.header("Expect"), "100-continue")) return read_rest();
    static constexpr std::string_view go_on = "HTTP/1.1 100 Continue\r\n\r\n";
    asio::async_write(stream_, asio::buffer(go_on), handler([this](ErrorCode fault, std::size_t) {
                        if (fault) return close();
                        read_rest();
                      }));
  }

  void read_rest() {
    http::async_read(
        stream_, buffer_, *parser_, handler([this](ErrorCode fault, std::size_t) {
          if (fault == http::error::body_limit) return refuse(body_too_large());
          if (fault == beast::error::timeout || fault == http::error::partial_message) {
            return close();
          }
          if (fault) return refuse_unparsed(fault);
          dispatch();
        }));
  }

  // --- answering --------------------------------------------------------------------------------

  void dispatch() {
    request_.body = std::move(parser_->get().body());
    keep_alive_ = parser_->get().keep_alive();
    stream_.expires_never();
    answering_ = true;
    watch_for_leaving();
    // The reply keeps the session alive, and gives it back to the io thread: it must not end on
    // the renderer's.
    route(services_, request_, [self = shared_from_this()](Response response) mutable {
      auto& socket = self->stream_.socket();
      asio::post(socket.get_executor(),
                 [self = std::move(self), response = std::move(response)]() mutable {
                   guarded(self, [&] { self->on_reply(std::move(response)); })();
                 });
    });
  }

  // While a picture is drawn nothing is read; a peer that closes its side wants it no more.
  void watch_for_leaving() {
    stream_.socket().async_wait(asio::ip::tcp::socket::wait_read, handler([this](ErrorCode fault) {
                                  if (fault || !answering_) return;
                                  char byte = 0;
                                  const auto handle = stream_.socket().native_handle();
                                  if (::recv(handle, &byte, 1, MSG_PEEK | MSG_DONTWAIT) > 0)
                                    return;  // its next request
                                  answering_ = false;
                                  abort();
                                }));
  }

  void on_reply(Response response) {
    if (!answering_) return;
    answering_ = false;
    ErrorCode ignored;
    stream_.socket().cancel(ignored);  // the watch alone: nothing else is under way
    send(std::move(response));
  }

  // An answer after which the connection is of no use: what follows it was not understood.
  void refuse(Response response) {
    response.close = true;
    idle_ = false;
    send(std::move(response));
  }

  void send(Response response) {
    keep_alive_ = keep_alive_ && !response.close && !draining_ && !services_.draining;
    response_ = std::move(response);
    head_ = response_head(response_, keep_alive_);
    const auto body = is_head_ ? std::span<const std::uint8_t>{} : response_.body.bytes;
    stream_.expires_after(write_deadline(body.size(), limits::write_timeout_s));
    const std::array<asio::const_buffer, 2> parts{asio::buffer(head_),
                                                  asio::buffer(body.data(), body.size())};
    asio::async_write(stream_, parts, handler([this](ErrorCode fault, std::size_t) {
                        if (fault) return close();
                        response_ = Response{};
                        keep_alive_ && !draining_ ? next_request() : linger();
                      }));
  }

  // Closing with unread bytes resets the connection, and the peer might never see the answer.
  void linger() {
    ErrorCode ignored;
    stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
    buffer_.clear();
    stream_.expires_after(linger_timeout);
    throw_away();
  }

  void throw_away() {
    stream_.async_read_some(buffer_.prepare(buffer_bytes_max),
                            handler([this](ErrorCode fault, std::size_t) {
                              if (fault) return close();
                              throw_away();
                            }));
  }

  // --- a stream ---------------------------------------------------------------------------------

  void upgrade() {
    if (!parser_->is_done() || buffer_.size() > 0) {
      return refuse(problem_response(400, "Bad Request", "an upgrade has no body"));
    }
    if (services_.draining) {
      return refuse(
          problem_response(make_error(ErrorKind::draining, "the server is shutting down")));
    }
    const std::string origin = request_.header("Origin");
    if (!origin.empty() &&
        !origin_allowed(origin, request_.header("Host"), services_.options.allow_origins)) {
      return refuse(problem_response(403, "Forbidden",
                                     "pages of " + printable(origin) + " may not connect here"));
    }
    stream_.expires_never();
    UpgradeRequest message;
    static_cast<http::request_header<>&>(message) = std::move(parser_->get().base());
    start_websocket_session(std::move(stream_), std::move(message), services_, connections_);
  }

  void close() {
    idle_ = false;
    stream_.close();
  }

  TcpStream stream_;
  Services& services_;
  Connections& connections_;
  const std::uint64_t id_;
  beast::flat_buffer buffer_{buffer_bytes_max};
  std::size_t searched_ = 0;  // bytes of buffer_ known not to begin the header's end
  std::optional<Parser> parser_;
  Request request_;
  Response response_;
  std::string head_;
  bool idle_ = false;       // waits for a request's first byte
  bool answering_ = false;  // waits for a reply
  bool is_head_ = false;
  bool keep_alive_ = false;
  bool draining_ = false;
};

}  // namespace

void start_http_session(asio::ip::tcp::socket socket, Services& services,
                        Connections& connections) {
  std::make_shared<HttpSession>(std::move(socket), services, connections)->start();
}

}  // namespace windsplat::net
