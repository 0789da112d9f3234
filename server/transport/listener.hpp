// The listening socket: keeps accepting when descriptors or memory run out.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "server/base/error.hpp"
#include "server/transport/spare_descriptor.hpp"

namespace windsplat::transport {

class Listener {
 public:
  using Accepted = std::function<void(boost::asio::ip::tcp::socket)>;
  using Failed = std::function<void()>;

  // `failed`: accepting a connection failed.
  Listener(boost::asio::io_context& io, Accepted accepted, Failed failed);

  // `address` is an IP address or host name of this machine. Errors: internal, naming address and
  // port.
  Result<void> listen(const std::string& address, std::uint16_t port);
  // Takes a TCP socket that listens already. Errors: internal.
  Result<void> adopt(int socket);
  [[nodiscard]] boost::asio::ip::tcp::endpoint endpoint() const { return endpoint_; }

  // Starts accepting. A further call resumes after an allocation failure stopped the accept loop,
  // and otherwise has no effect; do not call it from the accept handler.
  void start();
  void close();

 private:
  void accept();

  Accepted accepted_;
  Failed failed_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer retry_;
  SpareDescriptor spare_;
  boost::asio::ip::tcp::endpoint endpoint_;
  // Held by the pending accept or retry timer: expires when an allocation failure destroys its
  // handler.
  std::shared_ptr<const char> waiting_ = std::make_shared<const char>();
};

}  // namespace windsplat::transport
