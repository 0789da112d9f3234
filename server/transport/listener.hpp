// The listening socket: accepts until it is closed, whatever the system runs out of.
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

namespace windsplat::net {

class Listener {
 public:
  using Accepted = std::function<void(boost::asio::ip::tcp::socket)>;
  using Failed = std::function<void()>;

  // `failed`: the system could not hand over a connection.
  Listener(boost::asio::io_context& io, Accepted accepted, Failed failed);

  // `address` is an IP address or a name of this machine. Errors: internal, naming address and
  // port.
  Result<void> listen(const std::string& address, std::uint16_t port);
  [[nodiscard]] boost::asio::ip::tcp::endpoint endpoint() const { return endpoint_; }

  // Accepts from now on. Called again, and not by what was accepted, it goes on where memory failed
  // before the next connection could be waited for or handed over; else it changes nothing.
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
  // Shared by what waits for a connection, or for the time to try again: where memory fails for a
  // connection that has come, that goes uncalled.
  std::shared_ptr<const char> waiting_ = std::make_shared<const char>();
};

}  // namespace windsplat::net
