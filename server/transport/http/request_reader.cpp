// The header is read completely, checked as bytes and parsed before any of the body is read. Bodies
// need a Content-Length.
#include "server/transport/http/request_reader.hpp"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/http/read.hpp>
#include <string_view>
#include <utility>

#include "protocol/limits.hpp"
#include "server/http/body_sink.hpp"
#include "server/http/http_checks.hpp"
#include "server/transport/guarded.hpp"
#include "server/transport/post_or_retry.hpp"

namespace windsplat::transport {
namespace {

namespace limits = protocol::limits;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds first_timeout{5};  // deadline for the first byte of a connection
constexpr std::chrono::seconds idle_timeout{60};  // deadline for the next request of a connection
constexpr std::chrono::seconds drain_idle_timeout{2};
// Of a body that a sink takes: 8 KiB a second at least.
constexpr std::size_t part_bytes = std::size_t{256} << 10;
constexpr std::chrono::seconds part_timeout{32};
constexpr std::chrono::seconds sink_timeout{60};  // deadline for taking a part

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

std::uint64_t RequestReader::body_bytes() const {
  return input_.parser().content_length().value_or(0);
}

void RequestReader::read_body() {
  if (input_.parser().is_done()) return complete();
  unread_bytes_ = body_bytes();
  // The parser compares its limit while it parses the header, when it is not known who takes the
  // body.
  if (!current_.request.sink && unread_bytes_ > limits::http_body_bytes_max) {
    return owner_.refuse(http::body_too_large());
  }
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
  if (current_.request.sink) return stream_some();
  beast::http::async_read(wire_.wire(), input_.buffer(), input_.parser(),
                          owner_.handler([this](ErrorCode fault, std::size_t) {
                            // Other errors are those of the connection, or its deadline.
                            if (fault && !RequestParser::is_fault_of_text(fault))
                              return owner_.close();
                            if (fault) return owner_.refuse(RequestParser::refusal_of(fault));
                            complete();
                          }));
}

// One part of the body at a time: the next one is read when the sink has taken the last, so that a
// fast client waits for a slow disk.
void RequestReader::stream_some() {
  if (unread_bytes_ == 0) return complete();
  auto& buffer = input_.buffer();
  const std::size_t wanted =
      static_cast<std::size_t>(std::min<std::uint64_t>(unread_bytes_, part_bytes));
  std::vector<std::byte> part(wanted);
  const std::size_t received = asio::buffer_copy(asio::buffer(part), buffer.data());
  buffer.consume(received);
  if (received == wanted) return hand_over(std::move(part));
  wire_.within(part_timeout);
  const asio::mutable_buffer rest(part.data() + received, wanted - received);
  asio::async_read(
      wire_.wire(), rest,
      owner_.handler([this, part = std::move(part)](ErrorCode fault, std::size_t) mutable {
        if (fault) return owner_.close();
        hand_over(std::move(part));
      }));
}

void RequestReader::hand_over(std::vector<std::byte> bytes) {
  unread_bytes_ -= bytes.size();
  wire_.within(sink_timeout);
  const auto taken = [this](std::optional<http::Response> refusal) {
    refusal ? owner_.refuse(std::move(*refusal)) : stream_some();
  };
  current_.request.sink->take(std::move(bytes), [taken, weak = owner_.weak_from_this(),
                                                 executor = wire_.wire().get_executor()](
                                                    std::optional<http::Response> refusal) {
    // If this fails, the deadline closes the connection.
    post_or_retry(executor, [taken, weak, refusal = std::move(refusal)]() mutable {
      const auto owner = weak.lock();
      if (owner) guarded(owner, [&] { taken(std::move(refusal)); })();
    });
  });
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
