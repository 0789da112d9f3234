// A GET for a health check: connects, asks, reads the status line, all within one deadline.
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/streambuf.hpp>
#include <boost/asio/write.hpp>
#include <boost/url/parse.hpp>
#include <boost/url/url_view.hpp>
#include <charconv>
#include <chrono>
#include <istream>
#include <optional>
#include <string>

#include "server/net/server.hpp"

namespace windsplat::net {
namespace {

namespace asio = boost::asio;
using Tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;

constexpr std::size_t status_line_bytes_max = 1024;

// One exchange after the other; the first fault ends it.
struct Exchange {
  Exchange(const std::string& host, const std::string& port, std::string request_text)
      : request(std::move(request_text)) {
    resolver.async_resolve(host, port, [this](ErrorCode ec, const Tcp::resolver::results_type& to) {
      if (!failed(ec)) connect(to);
    });
  }

  void connect(const Tcp::resolver::results_type& to) {
    asio::async_connect(socket, to, [this](ErrorCode ec, const Tcp::endpoint&) {
      if (!failed(ec)) write();
    });
  }

  void write() {
    asio::async_write(socket, asio::buffer(request), [this](ErrorCode ec, std::size_t) {
      if (!failed(ec)) read();
    });
  }

  void read() {
    asio::async_read_until(socket, answer, "\r\n",
                           [this](ErrorCode ec, std::size_t) { done = !failed(ec); });
  }

  bool failed(ErrorCode ec) {
    fault = ec;
    return static_cast<bool>(ec);
  }

  asio::io_context io{1};
  Tcp::resolver resolver{io};
  Tcp::socket socket{io};
  std::string request;
  asio::streambuf answer{status_line_bytes_max};
  ErrorCode fault;
  bool done = false;
};

// "HTTP/1.1 200 OK" -> 200.
std::optional<int> status_of(asio::streambuf& answer) {
  std::istream in(&answer);
  std::string line;
  std::getline(in, line);
  constexpr std::size_t digits_at = 9;
  int status = 0;
  if (line.size() < digits_at + 3 || line.compare(0, 7, "HTTP/1.") != 0) return std::nullopt;
  const char* first = line.data() + digits_at;
  const auto [stop, fault] = std::from_chars(first, first + 3, status);
  if (fault != std::errc() || stop != first + 3 || status < 100) return std::nullopt;
  return status;
}

}  // namespace

Result<int> http_status(const std::string& url, int timeout_s) {
  const auto parts = boost::urls::parse_uri(url);
  if (!parts || parts->scheme() != "http" || parts->host().empty()) {
    return make_error(ErrorKind::malformed, "'" + printable(url) + "' is no http:// URL");
  }
  const std::string port = parts->has_port() ? std::string(parts->port()) : "80";
  std::string target(parts->encoded_target());
  if (target.empty()) target = "/";
  const std::string where = printable(url);
  Exchange exchange(parts->host_address(), port,
                    "GET " + target +
                        " HTTP/1.1\r\nHost: " + std::string(parts->encoded_host_and_port()) +
                        "\r\nUser-Agent: windsplat\r\nConnection: close\r\n\r\n");
  exchange.io.run_for(std::chrono::seconds(timeout_s));
  if (exchange.fault) {
    return make_error(ErrorKind::internal, where + ": " + exchange.fault.message());
  }
  if (!exchange.done) {
    return make_error(ErrorKind::internal,
                      where + ": no answer within " + std::to_string(timeout_s) + " s");
  }
  const auto status = status_of(exchange.answer);
  if (!status) return make_error(ErrorKind::internal, where + ": the answer is no HTTP");
  return *status;
}

}  // namespace windsplat::net
