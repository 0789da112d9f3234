// The stream, over TCP or a UNIX socket, of HTTP and WebSocket sessions, with the deadlines of
// Beast and a count of received bytes. Include it in session sources only, because it includes all
// of Beast.
#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/rate_policy.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <chrono>
#include <cstddef>
#include <limits>

namespace windsplat::transport {

namespace asio = boost::asio;
namespace beast = boost::beast;
using ErrorCode = boost::system::error_code;

// Beast rate policy without limits that counts received bytes since the last forget(). Detects
// messages that never end, which the WebSocket layer does not report.
class WireMeter {
 public:
  [[nodiscard]] std::size_t bytes_read() const { return bytes_read_; }
  void forget() { bytes_read_ = 0; }

 private:
  friend class beast::rate_policy_access;
  static constexpr std::size_t all = std::numeric_limits<std::size_t>::max();

  [[nodiscard]] std::size_t available_read_bytes() const { return all; }
  [[nodiscard]] std::size_t available_write_bytes() const { return all; }
  void transfer_read_bytes(std::size_t bytes) { bytes_read_ += bytes; }
  void transfer_write_bytes(std::size_t /*bytes*/) {}
  void on_timer() {}

  std::size_t bytes_read_ = 0;
};

// A socket of TCP or UNIX, in one type, so that Beast's templates are compiled once.
using StreamSocket = asio::generic::stream_protocol::socket;
using TcpStream =
    beast::basic_stream<asio::generic::stream_protocol, asio::any_io_executor, WireMeter>;
using UpgradeRequest = beast::http::request<beast::http::empty_body>;

// Timeout for a peer to receive `bytes`: a fixed part and 64 KiB/s.
inline std::chrono::milliseconds write_deadline(std::size_t bytes, int fixed_s) {
  return std::chrono::seconds(fixed_s) + std::chrono::milliseconds(bytes / 64);
}

}  // namespace windsplat::transport
