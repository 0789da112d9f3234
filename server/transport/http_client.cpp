// A GET for health checks: connect, TLS handshake, request and status line, all within one
// deadline.
#include "server/transport/http_client.hpp"

#include <openssl/ssl.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/streambuf.hpp>
#include <boost/asio/write.hpp>
#include <boost/url/parse.hpp>
#include <boost/url/url_view.hpp>
#include <charconv>
#include <chrono>
#include <istream>
#include <optional>
#include <string>

#include "server/transport/unix_socket.hpp"

namespace windsplat::transport {
namespace {

namespace asio = boost::asio;
using Tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;

constexpr std::size_t status_line_bytes_max = 1024;

// The parsed URL and the request.
struct Question {
  std::string host;
  std::string port;
  std::string text;
  bool secure = false;
  std::string path;  // of a UNIX socket, instead of host and port
};

// The root certificates for verification. Errors: invalid.
Result<void> trust(asio::ssl::context& context, const std::string& ca) {
  ErrorCode fault;
  context.set_verify_mode(asio::ssl::verify_peer);
  SSL_CTX_set_min_proto_version(context.native_handle(), TLS1_2_VERSION);
  if (ca.empty()) {
    context.set_default_verify_paths(fault);
  } else {
    context.add_certificate_authority(asio::buffer(ca), fault);
    // A certificate that is trusted explicitly needs no issuer.
    X509_VERIFY_PARAM_set_flags(SSL_CTX_get0_param(context.native_handle()),
                                X509_V_FLAG_PARTIAL_CHAIN);
  }
  if (!fault) return {};
  return make_error(ErrorKind::invalid,
                    "cannot read the trusted certificates: " + printable(fault.message()));
}

// Runs one operation after the other; the first error ends the exchange.
struct Exchange {
  Exchange(Question asked, asio::ssl::context& context)
      : question(std::move(asked)), stream(io, context) {
    question.path.empty() ? resolve() : connect_to_socket();
  }

  void resolve() {
    resolver.async_resolve(question.host, question.port,
                           [this](ErrorCode ec, const Tcp::resolver::results_type& to) {
                             if (!failed(ec)) connect(to);
                           });
  }

  void connect_to_socket() {
    if (question.path.size() > unix_path_bytes_max) {
      fault = asio::error::name_too_long;
      return;
    }
    local.async_connect(asio::local::stream_protocol::endpoint(question.path),
                        [this](ErrorCode ec) {
                          if (!failed(ec)) ask(local);
                        });
  }

  void connect(const Tcp::resolver::results_type& to) {
    asio::async_connect(stream.next_layer(), to, [this](ErrorCode ec, const Tcp::endpoint&) {
      if (failed(ec)) return;
      question.secure ? handshake() : ask(stream.next_layer());
    });
  }

  void handshake() {
    ErrorCode is_name;  // SNI allows names only, no addresses
    (void)asio::ip::make_address(question.host, is_name);
    if (is_name) SSL_set_tlsext_host_name(stream.native_handle(), question.host.c_str());
    SSL* ssl = stream.native_handle();
    const int named =
        is_name ? SSL_set1_host(ssl, question.host.c_str())
                : X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl), question.host.c_str());
    if (named != 1) {  // never continue unverified
      fault = asio::error::invalid_argument;
      return;
    }
    stream.async_handshake(asio::ssl::stream_base::client, [this](ErrorCode ec) {
      if (!failed(ec)) ask(stream);
    });
  }

  template <class Stream>
  void ask(Stream& over) {
    asio::async_write(over, asio::buffer(question.text), [this, &over](ErrorCode ec, std::size_t) {
      if (failed(ec)) return;
      asio::async_read_until(over, answer, "\r\n",
                             [this](ErrorCode fault, std::size_t) { done = !failed(fault); });
    });
  }

  // Describes the error; for a rejected certificate also the reason.
  [[nodiscard]] std::string reason(bool trusts_given) {
    std::string out = fault.message();
    if (!question.secure || fault.category() != asio::error::get_ssl_category()) return out;
    const long result = SSL_get_verify_result(stream.native_handle());
    if (result == X509_V_OK) return out;
    out += std::string(" (") + X509_verify_cert_error_string(result) + ")";
    return trusts_given ? out : out + "; use --ca to name certificates to trust";
  }

  bool failed(ErrorCode ec) {
    fault = ec;
    return static_cast<bool>(ec);
  }

  asio::io_context io{1};
  Tcp::resolver resolver{io};
  Question question;
  asio::ssl::stream<Tcp::socket> stream;
  asio::local::stream_protocol::socket local{io};
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

Result<int> http_status(const std::string& url, int timeout_s, const std::string& ca) {
  const auto parts = boost::urls::parse_uri(url);
  const bool secure = parts && parts->scheme() == "https";
  const bool is_local = parts && parts->scheme() == "http+unix";
  if (!parts || (!secure && !is_local && parts->scheme() != "http") || parts->host().empty()) {
    return make_error(
        ErrorKind::malformed,
        "'" + printable(url) + "' does not begin with http://, https:// or http+unix://");
  }
  asio::ssl::context context(asio::ssl::context::tls_client);
  if (secure) {
    if (const auto ok = trust(context, ca); !ok) return ok.error();
  }
  std::string target(parts->encoded_target());
  if (target.empty()) target = "/";
  const std::string where = printable(url);
  Question question;
  question.host = parts->host_address();
  question.port = parts->has_port() ? std::string(parts->port()) : secure ? "443" : "80";
  question.text = "GET " + target + " HTTP/1.1\r\nHost: " +
                  (is_local ? "localhost" : std::string(parts->encoded_host_and_port())) +
                  "\r\nUser-Agent: windsplat\r\nConnection: close\r\n\r\n";
  question.secure = secure;
  if (is_local) question.path = parts->host();
  Exchange exchange(std::move(question), context);
  exchange.io.run_for(std::chrono::seconds(timeout_s));
  if (exchange.fault) {
    return make_error(ErrorKind::internal, where + ": " + exchange.reason(!ca.empty()));
  }
  if (!exchange.done) {
    return make_error(ErrorKind::internal,
                      where + ": no response within " + std::to_string(timeout_s) + " s");
  }
  const auto status = status_of(exchange.answer);
  if (!status) return make_error(ErrorKind::internal, where + ": the response is not HTTP");
  return *status;
}

}  // namespace windsplat::transport
