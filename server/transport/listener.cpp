// Binds, then accepts connections one at a time.
#include "server/transport/listener.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <chrono>
#include <exception>
#include <utility>

#include "server/base/log.hpp"
#include "server/transport/peer.hpp"

namespace windsplat::transport {
namespace {

namespace asio = boost::asio;
using Protocol = asio::generic::stream_protocol;
using ErrorCode = boost::system::error_code;

constexpr std::chrono::milliseconds retry_delay{100};
// Size of the kernel's send buffer; the kernel doubles this value.
constexpr int send_buffer_bytes = 128 * 1024;

// Limit on unsent bytes in the kernel (TCP_NOTSENT_LOWAT): with more, writes complete long before
// the data is sent, and later data is delayed.
constexpr int unsent_bytes = 16 * 1024;

// Best effort: failure only increases latency.
void hasten(Protocol::socket& socket) {
  const int on = 1;
  (void)setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  (void)setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent_bytes,
                   sizeof unsent_bytes);
}

bool is_lacking(ErrorCode fault) {
  return fault == boost::system::errc::address_not_available ||
         fault == boost::system::errc::address_family_not_supported;
}

}  // namespace

Listener::Listener(asio::io_context& io, Accepted accepted, Failed failed)
    : accepted_(std::move(accepted)), failed_(std::move(failed)), acceptor_(io), retry_(io) {}

Result<void> Listener::listen(const api::ListenPlace& place) {
  if (!place.path.empty()) return listen_on_unix(place);
  ErrorCode fault;
  const auto ip = asio::ip::make_address(place.address, fault);
  if (fault) {
    return make_error(ErrorKind::internal, "cannot listen on " + printable(place.address) +
                                               ": the address is not numeric");
  }
  const auto protocol = asio::ip::tcp::endpoint(ip, 0).protocol();
  if (auto ok = place.socket < 0 ? bind_tcp(ip, place) : adopt(protocol, place.socket); !ok) {
    return ok;
  }
  port_ = port_of(acceptor_.native_handle());
  host_ = ip.is_unspecified() ? "127.0.0.1"
          : ip.is_v6()        ? '[' + ip.to_string() + ']'
                              : ip.to_string();
  return {};
}

Result<void> Listener::bind_tcp(const asio::ip::address& ip, const api::ListenPlace& place) {
  ErrorCode fault;
  const asio::ip::tcp::endpoint endpoint(ip, place.port);
  acceptor_.open(endpoint.protocol(), fault);
  if (!fault) acceptor_.set_option(asio::socket_base::reuse_address(true), fault);
  // Accepted sockets inherit these options.
  if (!fault) acceptor_.set_option(asio::socket_base::send_buffer_size(send_buffer_bytes), fault);
  if (!fault) acceptor_.bind(endpoint, fault);
  if (!fault) acceptor_.listen(asio::socket_base::max_listen_connections, fault);
  if (!fault) return {};
  const bool taken = fault == boost::system::errc::address_in_use;
  return make_error(is_lacking(fault) ? ErrorKind::not_found : ErrorKind::internal,
                    "cannot listen on " + printable(place.address) + " port " +
                        std::to_string(place.port) + ": " + fault.message() +
                        (taken ? "; use port 0 for any free port" : ""));
}

Result<void> Listener::adopt(const Protocol& protocol, int socket) {
  ErrorCode fault;
  acceptor_.assign(protocol, socket, fault);
  if (!fault) acceptor_.set_option(asio::socket_base::send_buffer_size(send_buffer_bytes), fault);
  if (!fault) return {};
  return make_error(ErrorKind::internal,
                    "cannot listen on the socket that was passed: " + fault.message());
}

Result<void> Listener::listen_on_unix(const api::ListenPlace& place) {
  path_ = place.path;
  if (place.socket >= 0) return adopt(asio::local::stream_protocol(), place.socket);
  if (auto stale = remove_stale_socket(place.path); !stale) return stale;
  ErrorCode fault;
  acceptor_.open(asio::local::stream_protocol(), fault);
  if (!fault) acceptor_.bind(asio::local::stream_protocol::endpoint(place.path), fault);
  // Nobody can connect before listen(), so the mode holds from the first connection on.
  if (!fault) {
    if (auto owned = file_.own(place.path, place.mode); !owned) return owned;
    acceptor_.listen(asio::socket_base::max_listen_connections, fault);
  }
  if (!fault) return {};
  return make_error(ErrorKind::internal,
                    "cannot listen on unix:" + printable(place.path) + ": " + fault.message());
}

std::string Listener::url(bool tls, const std::string& base_path) const {
  if (port_ == 0) return unix_url(path_, base_path);
  return (tls ? "https://" : "http://") + host_ + ':' + std::to_string(port_) + base_path;
}

void Listener::start() {
  if (waiting_.use_count() == 1 && acceptor_.is_open()) accept();
}

void Listener::close() {
  ErrorCode ignored;
  acceptor_.close(ignored);
  file_.remove();
  retry_.cancel();
}

void Listener::accept() {
  acceptor_.async_accept([this, waits = waiting_](ErrorCode fault, Protocol::socket socket) {
    if (!acceptor_.is_open()) return;
    if (!fault) {
      hasten(socket);
      try {
        accepted_(std::move(socket));
      } catch (const std::exception& failure) {
        // Drops this connection and continues accepting.
        log::error("cannot serve a connection", {{"fault", failure.what()}});
      }
      return accept();
    }
    if (fault == asio::error::connection_aborted) return accept();
    // Out of descriptors or memory: retry when others have released some.
    log::warn("cannot accept", {{"fault", fault.message()}});
    failed_();
    spare_.turn_away(acceptor_.native_handle());
    retry_.expires_after(retry_delay);
    retry_.async_wait([this, waits](ErrorCode cancelled) {
      if (!cancelled) accept();
    });
  });
}

}  // namespace windsplat::transport
