// The header is read completely, checked as bytes and parsed before any of the body is read. Bodies
// need a Content-Length.
#include "server/transport/http/request_reader.hpp"

#include <boost/asio/write.hpp>
#include <boost/beast/http/read.hpp>
#include <string_view>
#include <utility>

#include "protocol/limits.hpp"
#include "server/http/http_checks.hpp"

namespace windsplat::transport {
namespace {

namespace limits = protocol::limits;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds first_timeout{5};  // deadline for the first byte of a connection
constexpr std::chrono::seconds idle_timeout{60};  // deadline for the next request of a connection
constexpr std::chrono::seconds drain_idle_timeout{2};

}  // namespace

RequestReader::RequestReader(HttpOwner& owner, HttpWire& wire, CurrentRequest& current)
    : owner_(owner), wire_(wire), current_(current) {}

void RequestReader::next(bool draining) {
  input_.begin();
  if (input_.has_input()) return begin_header();
  idle_since_ = Clock::now();
  wire_.within(draining ? drain_idle_timeout : unasked_since_ ? first_timeout : idle_timeout);
  read_some();
}

void RequestReader::begin_header() {
  idle_since_.reset();
  in_header_ = true;
  current_.began = Clock::now();
  wire_.within(std::chrono::seconds(limits::http_header_timeout_s));
  find_header_end();
}

// A read may be pending since watch(); the buffer then stays empty until it completes.
void RequestReader::read_some() {
  wire_.read_some(input_, [this](ErrorCode fault) {
    if (fault) {
      ended_ = true;
      return owner_.on_end();
    }
    if (idle_since_) return begin_header();
    // Otherwise the next request of the client stays in the buffer.
    if (in_header_) find_header_end();
  });
}

void RequestReader::find_header_end() {
  auto header = input_.parse_header();
  if (!header.complete) return read_some();
  in_header_ = false;
  if (header.refusal) return owner_.refuse(std::move(*header.refusal));
  input_.copy_header(current_.request);
  current_.is_head = current_.request.method == "HEAD";
  owner_.on_header();
}

void RequestReader::read_body() {
  if (input_.parser().is_done()) return complete();
  wire_.within(std::chrono::seconds(limits::http_body_timeout_s));
  // Ignored in HTTP/1.0 (RFC 9110, 10.1.1).
  const bool expects = input_.parser().get().version() == 11 &&
                       http::equal_without_case(current_.request.header("Expect"), "100-continue");
  if (!expects) return read_rest();
  static constexpr std::string_view go_on = "HTTP/1.1 100 Continue\r\n\r\n";
  asio::async_write(wire_.wire(), asio::buffer(go_on),
                    owner_.handler([this](ErrorCode fault, std::size_t) {
                      if (fault) return owner_.close();
                      read_rest();
                    }));
}

void RequestReader::read_rest() {
  beast::http::async_read(wire_.wire(), input_.buffer(), input_.parser(),
                          owner_.handler([this](ErrorCode fault, std::size_t) {
                            if (fault == beast::http::error::body_limit)
                              return owner_.refuse(http::body_too_large());
                            // Other errors are those of the connection, or its deadline.
                            if (fault && !RequestParser::is_fault_of_text(fault))
                              return owner_.close();
                            if (fault) return owner_.refuse(RequestParser::refusal_of(fault));
                            complete();
                          }));
}

void RequestReader::complete() {
  unasked_since_.reset();
  current_.request.body = std::move(input_.parser().get().body());
  current_.keep_alive = input_.parser().get().keep_alive();
  wire_.with_no_deadline();
  owner_.on_request();
}

void RequestReader::watch() {
  if (!input_.has_input()) read_some();
}

void RequestReader::stop() {
  idle_since_.reset();
  in_header_ = false;
}

}  // namespace windsplat::transport
