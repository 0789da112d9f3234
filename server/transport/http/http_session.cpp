// HTTP over TCP or TLS. A request is refused if necessary before any of its body is read.
#include "server/transport/http/http_session.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/access/address.hpp"
#include "server/http/cors.hpp"
#include "server/http/gzip.hpp"
#include "server/http/http_checks.hpp"
#include "server/http/problem.hpp"
#include "server/transport/http/current_request.hpp"
#include "server/transport/http/http_gate.hpp"
#include "server/transport/http/http_owner.hpp"
#include "server/transport/http/http_wire.hpp"
#include "server/transport/http/request_reader.hpp"
#include "server/transport/http/request_work.hpp"
#include "server/transport/http/response_writer.hpp"
#include "server/transport/websocket/websocket_session.hpp"
#include "server/transport/wire.hpp"

namespace windsplat::transport {
namespace {

bool is_preflight(const HttpContext& context, const CurrentRequest& current) {
  return http::is_preflight(current.request, context.options.allow_origins);
}

class HttpSession final : public Connection, public HttpOwner {
 public:
  HttpSession(const HttpContext& context, Wire wire, access::Visitor visitor)
      : context_(context),
        id_(context.connections.next_id()),
        visitor_(std::move(visitor)),
        current_{blank_request(), api::route_other, std::chrono::steady_clock::now()},
        wire_(*this, std::move(wire), visitor_.reserve.has_value()),
        reader_(*this, wire_, current_),
        writer_(*this, wire_, context, current_),
        work_(*this, wire_) {}
  ~HttpSession() override { context_.connections.remove(id_); }
  HttpSession(const HttpSession&) = delete;
  HttpSession& operator=(const HttpSession&) = delete;

  // The drain waits only for requests already in progress: otherwise a busy client could delay it.
  // `refusal`: of all its requests.
  void start(bool late, std::optional<http::Response> refusal) {
    context_.connections.add(id_, std::static_pointer_cast<HttpSession>(shared_from_this()), false,
                             late);
    refusal ? refuse(std::move(*refusal)) : next_request();
  }

  void drain() override {
    if (reader_.idle_since()) close();
  }

  void abort() override {
    current_.request.cancel.cancel();
    close();
  }

  void close() override {
    reader_.stop();
    work_.stop();
    wire_.close();
    visitor_.place.reset();  // free the slot at once
  }

  void on_header() override {
    http::Request& request = current_.request;
    std::string id = request.header(http::request_id_header);
    request.id = http::is_request_id(id) ? std::move(id) : context_.request_ids.next();
    const auto& message = reader_.input().parser().get();
    if (auto fault = check_form(context_.options, request, message.target(), message.version())) {
      return refuse(std::move(*fault));
    }
    current_.charged = true;
    current_.route = context_.router.name_of(request);
    const bool health = context_.router.names_health(request);
    if (auto refusal = context_.admission.request(visitor_, request, health)) {
      return refuse(std::move(*refusal));
    }
    if (is_preflight(context_, current_)) return reader_.read_body();
    const bool upgrade =
        http::asks_for_websocket(request, message.version()) && api::names_stream(request);
    if (upgrade) current_.route = api::route_stream;
    if (auto refusal = check_access(context_.options, context_.admission, request, health, upgrade,
                                    wire_.secure())) {
      return refuse(std::move(*refusal));
    }
    upgrade ? begin_stream() : receive_body();
  }

  void on_request() override {
    if (is_preflight(context_, current_)) {
      current_.route = api::route_preflight;
      return writer_.send(http::preflight_response());
    }
    if (auto fault = http::decode_body(current_.request)) return writer_.send(std::move(*fault));
    if (auto answer =
            answer_login(context_.options, context_.admission, current_.request, wire_.secure())) {
      current_.route = api::route_login;
      return writer_.send(std::move(*answer));
    }
    reader_.watch();
    work_.start(context_, current_);
  }

  void on_reply(http::Response response) override {
    if (work_.finish()) writer_.send(std::move(response));
  }

  // The rest of the stream cannot be parsed.
  void refuse(http::Response response) override {
    http::Request& request = current_.request;
    response.close = true;
    // Requests refused before parsing are charged as well.
    if (!current_.charged) {
      current_.quiet = !context_.admission.count_malformed(visitor_, request);
    }
    if (request.id.empty()) request.id = context_.request_ids.next();  // refused before parsing
    writer_.send(std::move(response));
  }

  // End of stream is reported once: another read would hang.
  void on_written(ErrorCode fault) override {
    if (fault || reader_.has_ended()) return close();
    current_.keep_alive && !context_.draining ? next_request() : wire_.linger(reader_.input());
  }

  void on_end() override {
    if (work_.finish()) {
      writer_.send_nothing();
      abort();
    } else if (!writer_.is_sending()) {  // half-closed: it may still read the response
      close();
    }
  }

  [[nodiscard]] Since idle_since() const override {
    return visitor_.reserve ? std::nullopt : reader_.idle_since();
  }
  [[nodiscard]] Since unasked_since() const override {
    return visitor_.reserve && visitor_.place ? reader_.unasked_since() : std::nullopt;
  }
  [[nodiscard]] const std::string& request_id() const override { return current_.request.id; }

 private:
  void receive_body() {
    http::Request& request = current_.request;
    auto streamed = context_.router.stream_body(request, reader_.body_bytes());
    if (streamed.refusal) return refuse(std::move(*streamed.refusal));
    request.sink = std::move(streamed.sink);
    reader_.read_body();
  }

  // Charged to the peer until the client address is known.
  [[nodiscard]] http::Request blank_request() const {
    http::Request request;
    request.peer = id_;
    request.address = access::counted_address(visitor_.peer);
    return request;
  }

  void next_request() {
    current_ = {blank_request(), api::route_other, current_.began};
    reader_.next(context_.draining);
  }

  void begin_stream() {
    const http::Request& request = current_.request;
    RequestParser& input = reader_.input();
    if (!input.parser().is_done() || input.has_input()) {
      return refuse(http::problem_response(400, "Bad Request", "an upgrade must have no body"));
    }
    if (auto fault = http::check_upgrade(request)) return refuse(std::move(*fault));
    if (context_.draining) {
      return refuse(
          http::problem_response(make_error(ErrorKind::draining, "the server is shutting down")));
    }
    auto seat = context_.admission.open_session(request.address);
    if (seat.refusal) return refuse(std::move(*seat.refusal));
    wire_.with_no_deadline();
    UpgradeRequest message;
    static_cast<beast::http::request_header<>&>(message) = std::move(input.parser().get().base());
    // The library parses only the first line of a list header.
    message.set(beast::http::field::connection, "Upgrade");
    message.set(beast::http::field::upgrade, "websocket");
    start_websocket_session(context_.streams, std::move(wire_.wire()), message, request.id,
                            {request.address, std::move(visitor_.place), std::move(seat.place)});
  }

  const HttpContext& context_;
  const std::uint64_t id_;
  access::Visitor visitor_;
  CurrentRequest current_;
  HttpWire wire_;
  RequestReader reader_;
  ResponseWriter writer_;
  RequestWork work_;
};

}  // namespace

void start_http_session(const HttpContext& context, Wire wire, access::Visitor visitor, bool late) {
  std::make_shared<HttpSession>(context, std::move(wire), std::move(visitor))
      ->start(late, std::nullopt);
}

void refuse_plain_http(const HttpContext& context, Wire wire, access::Visitor visitor, bool late) {
  std::make_shared<HttpSession>(context, std::move(wire), std::move(visitor))
      ->start(late,
              http::problem_response(400, "Bad Request", "this port requires TLS: use https://"));
}

}  // namespace windsplat::transport
