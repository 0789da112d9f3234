// Binds, then accepts connections one at a time.
#include "server/transport/listener.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <chrono>
#include <exception>
#include <utility>

#include "server/base/log.hpp"

namespace windsplat::transport {
namespace {

namespace asio = boost::asio;
using Tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;

constexpr std::chrono::milliseconds retry_delay{100};
// Size of the kernel's send buffer; the kernel doubles this value.
constexpr int send_buffer_bytes = 128 * 1024;

// Limit on unsent bytes in the kernel (TCP_NOTSENT_LOWAT): with more, writes complete long before
// the data is sent, and later data is delayed.
constexpr int unsent_bytes = 16 * 1024;

// Best effort: failure only increases latency.
void hasten(Tcp::socket& socket) {
  ErrorCode ignored;
  socket.set_option(Tcp::no_delay(true), ignored);
  (void)setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent_bytes,
                   sizeof unsent_bytes);
}

ErrorCode bind(Tcp::acceptor& acceptor, const Tcp::endpoint& endpoint) {
  ErrorCode fault;
  acceptor.open(endpoint.protocol(), fault);
  if (!fault) acceptor.set_option(Tcp::acceptor::reuse_address(true), fault);
  // Accepted sockets inherit these options.
  if (!fault) acceptor.set_option(asio::socket_base::send_buffer_size(send_buffer_bytes), fault);
  if (!fault) acceptor.bind(endpoint, fault);
  if (!fault) acceptor.listen(asio::socket_base::max_listen_connections, fault);
  return fault;
}

}  // namespace

Listener::Listener(asio::io_context& io, Accepted accepted, Failed failed)
    : accepted_(std::move(accepted)), failed_(std::move(failed)), acceptor_(io), retry_(io) {}

Result<void> Listener::listen(const std::string& address, std::uint16_t port) {
  const std::string where = printable(address) + " port " + std::to_string(port);
  ErrorCode fault;
  Tcp::endpoint endpoint;
  const auto ip = asio::ip::make_address(address, fault);
  if (!fault) {
    endpoint = Tcp::endpoint(ip, port);
  } else {
    Tcp::resolver resolver(acceptor_.get_executor());
    const auto found = resolver.resolve(address, std::to_string(port), fault);
    if (fault || found.empty()) {
      return make_error(ErrorKind::internal,
                        "cannot listen on " + where + ": no such address here");
    }
    endpoint = found.begin()->endpoint();
  }
  fault = bind(acceptor_, endpoint);
  if (fault) {
    const bool taken = fault == boost::system::errc::address_in_use;
    return make_error(ErrorKind::internal, "cannot listen on " + where + ": " + fault.message() +
                                               (taken ? "; use port 0 for any free port" : ""));
  }
  endpoint_ = acceptor_.local_endpoint(fault);
  return {};
}

Result<void> Listener::adopt(int socket) {
  sockaddr_storage name{};
  socklen_t size = sizeof name;
  ErrorCode fault;
  const bool known = ::getsockname(socket, reinterpret_cast<sockaddr*>(&name), &size) == 0;
  acceptor_.assign(known && name.ss_family == AF_INET6 ? Tcp::v6() : Tcp::v4(), socket, fault);
  if (!fault) acceptor_.set_option(asio::socket_base::send_buffer_size(send_buffer_bytes), fault);
  if (!fault) endpoint_ = acceptor_.local_endpoint(fault);
  if (fault) {
    return make_error(ErrorKind::internal,
                      "cannot listen on the socket that was passed: " + fault.message());
  }
  return {};
}

void Listener::start() {
  if (waiting_.use_count() == 1 && acceptor_.is_open()) accept();
}

void Listener::close() {
  ErrorCode ignored;
  acceptor_.close(ignored);
  retry_.cancel();
}

void Listener::accept() {
  acceptor_.async_accept([this, waits = waiting_](ErrorCode fault, Tcp::socket socket) {
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
