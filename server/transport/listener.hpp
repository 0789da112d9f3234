// A listening socket: keeps accepting when descriptors or memory run out.
#pragma once

#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/api/server_options.hpp"
#include "server/base/error.hpp"
#include "server/transport/spare_descriptor.hpp"
#include "server/transport/unix_socket.hpp"

namespace windsplat::transport {

class Listener {
 public:
  using Accepted = std::function<void(boost::asio::generic::stream_protocol::socket)>;
  using Failed = std::function<void()>;

  // `failed`: accepting a connection failed.
  Listener(boost::asio::io_context& io, Accepted accepted, Failed failed);

  // Errors name the place: not_found if this machine lacks the address, else internal.
  Result<void> listen(const api::ListenPlace& place);
  // Of TCP; 0: a UNIX socket.
  [[nodiscard]] std::uint16_t port() const { return port_; }
  // To open in a browser or for `windsplat healthcheck`. The wildcard address is replaced by
  // 127.0.0.1, which it includes.
  [[nodiscard]] std::string url(bool tls, const std::string& base_path) const;

  // Starts accepting. A further call resumes after an allocation failure stopped the accept loop,
  // and otherwise has no effect; do not call it from the accept handler.
  void start();
  void close();

 private:
  using Acceptor = boost::asio::basic_socket_acceptor<boost::asio::generic::stream_protocol>;

  Result<void> bind_tcp(const boost::asio::ip::address& ip, const api::ListenPlace& place);
  Result<void> adopt(const Acceptor::protocol_type& protocol, int socket);
  Result<void> listen_on_unix(const api::ListenPlace& place);
  void accept();

  Accepted accepted_;
  Failed failed_;
  Acceptor acceptor_;
  boost::asio::steady_timer retry_;
  SpareDescriptor spare_;
  UnixSocketFile file_;  // of a UNIX socket made here; the file of a passed one is not removed
  std::string path_;     // of a UNIX socket
  std::string host_;     // of TCP, as in a URL
  std::uint16_t port_ = 0;
  // Held by the pending accept or retry timer: expires when an allocation failure destroys its
  // handler.
  std::shared_ptr<const char> waiting_ = std::make_shared<const char>();
};

}  // namespace windsplat::transport
