// The listening socket: accepts until it is closed, whatever the system runs out of.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <functional>
#include <string>

#include "server/base/error.hpp"

namespace windsplat::net {

class Listener {
 public:
  using Accepted = std::function<void(boost::asio::ip::tcp::socket)>;

  Listener(boost::asio::io_context& io, Accepted accepted);

  // `address` is an IP address or a name of this machine. Errors: internal, naming address and
  // port.
  Result<void> listen(const std::string& address, std::uint16_t port);
  [[nodiscard]] boost::asio::ip::tcp::endpoint endpoint() const { return endpoint_; }

  void start();
  void close();

 private:
  void accept();

  Accepted accepted_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer retry_;
  boost::asio::ip::tcp::endpoint endpoint_;
};

}  // namespace windsplat::net
