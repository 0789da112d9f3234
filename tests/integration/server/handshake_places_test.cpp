// Eviction of pending handshakes, and release of ended ones: connections as passed on by the
// listener, in an io loop that the test advances, so that no deadline interferes.
#include <gmock/gmock.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <future>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "server/transport/connections.hpp"
#include "server/transport/handshake.hpp"
#include "server/transport/server_parts.hpp"
#include "server/transport/tls.hpp"
#include "tests/integration/certificate.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;
using testing::Not;
using windsplat::access::Visitor;
using windsplat::transport::HandshakeThread;
using Tcp = boost::asio::ip::tcp;

class HandshakePlaces : public testing::Test {
 protected:
  // The order of destruction as in server.cpp.
  ~HandshakePlaces() override {
    parts.connections.each([](windsplat::transport::Connection& one) { one.abort(); });
    gate_.set_value();
    thread.stop();
    go_on();
  }

  static windsplat::api::ServerOptions over_tls() {
    const Certificate made = make_certificate("places");
    windsplat::api::ServerOptions options;
    options.tls = windsplat::transport::make_tls(made.chain, made.key).value();
    return options;
  }

  // The client end of a connection from that address.
  Tcp::socket& come(const std::string& address, bool known = false) {
    Tcp::socket& client = clients.emplace_back(io);
    client.connect(acceptor.local_endpoint());
    windsplat::transport::start_connection(parts.http, acceptor.accept(), &thread,
                                           Visitor{address, nullptr, std::nullopt, false, known});
    return client;
  }

  void go_on() {
    io.restart();  // stops when no work is left
    io.poll();
  }

  // Waits until the thread has received the waiting steps of that address.
  void wait_for_steps(const std::string& address) {
    std::promise<void> done;
    thread.submit(address, [&done] { done.set_value(); });
    done.get_future().wait();
  }
  // Busy until the test ends.
  void hold_thread() {
    std::promise<void> begun;
    thread.submit("0", [&begun, end = gate_.get_future()]() mutable {
      begun.set_value();
      end.wait();
    });
    begun.get_future().wait();
  }

  static std::size_t open_descriptors() {
    const std::filesystem::directory_iterator all("/proc/self/fd");
    return static_cast<std::size_t>(std::distance(begin(all), end(all)));
  }

  static bool is_closed(Tcp::socket& client, int patience = patience_ms) {
    pollfd wait{client.native_handle(), POLLIN, 0};
    if (::poll(&wait, 1, patience) <= 0) return false;
    char byte = 0;
    return ::recv(client.native_handle(), &byte, 1, MSG_PEEK | MSG_DONTWAIT) <= 0;
  }
  static bool is_open(Tcp::socket& client) { return !is_closed(client, 0); }

  // The first bytes of a client.
  static std::string client_hello() {
    const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(
        SSL_CTX_new(TLS_client_method()), SSL_CTX_free);
    const std::unique_ptr<SSL, decltype(&SSL_free)> ssl(SSL_new(context.get()), SSL_free);
    BIO* const out = BIO_new(BIO_s_mem());
    SSL_set_bio(ssl.get(), BIO_new(BIO_s_mem()), out);
    SSL_connect(ssl.get());
    std::string hello(4096, '\0');
    const int size = BIO_read(out, hello.data(), static_cast<int>(hello.size()));
    hello.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return hello;
  }

  windsplat::transport::ServerParts parts{
      over_tls(), std::make_shared<windsplat::data::Store>(std::uint64_t{1} << 20),
      std::make_shared<windsplat::ThreadPool>(1)};
  boost::asio::io_context io{1};
  HandshakeThread thread;
  Tcp::acceptor acceptor{io, Tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0)};
  std::deque<Tcp::socket> clients;

 private:
  std::promise<void> gate_;
};

TEST_F(HandshakePlaces, ReleasedSlotsHoldNoDescriptor) {
  const std::string address = "192.0.2.1";
  const std::size_t before = open_descriptors();
  for (int n = 0; n < 32; ++n) come(address);
  wait_for_steps(address);  // these wait for bytes, the others for their turn
  hold_thread();
  for (int n = 0; n < 200; ++n) come(address);
  EXPECT_TRUE(comes_true([&] {
    go_on();
    return open_descriptors() <= before + clients.size() + 64;
  })) << open_descriptors() - before - clients.size();
}

TEST_F(HandshakePlaces, OfAnAddressGoToItsNewestConnections) {
  Tcp::socket& other = come("192.0.2.2");
  for (int n = 0; n < 64; ++n) come("192.0.2.1");
  EXPECT_TRUE(is_open(clients[1]));
  come("192.0.2.1");
  EXPECT_TRUE(is_closed(clients[1])) << "the oldest of that address";
  for (std::size_t n = 2; n < clients.size(); ++n) EXPECT_TRUE(is_open(clients[n])) << n;
  EXPECT_TRUE(is_open(other));
}

TEST_F(HandshakePlaces, OfManyAddressesAreTakenFromTheLargestHolder) {
  Tcp::socket& lonely = come("198.51.100.1");
  Tcp::socket& known = come("198.51.100.2", true);
  Tcp::socket& crowd = come("192.0.2.0");
  for (int n = 1; n < 300; ++n) come("192.0.2." + std::to_string(n % 5));
  EXPECT_TRUE(is_closed(crowd));
  EXPECT_TRUE(is_open(lonely));
  EXPECT_TRUE(is_open(known));
}

TEST_F(HandshakePlaces, OfAuthenticatedAddressesAreNotTakenByOthers) {
  for (int n = 0; n < 256; ++n) come("192.0.2." + std::to_string(n % 4), true);
  EXPECT_TRUE(is_closed(come("198.51.100.1")));
  for (std::size_t n = 0; n < 256; ++n) EXPECT_TRUE(is_open(clients[n])) << n;
  EXPECT_TRUE(is_open(come("198.51.100.2", true)));
  EXPECT_TRUE(is_closed(clients[0]));
}

TEST_F(HandshakePlaces, AreChargedForComputationBeforeTheClose) {
  const std::string hello = client_hello();
  ASSERT_FALSE(hello.empty());
  const auto took = [&] { return parts.metrics.text({}); };
  const std::string nothing = "windsplat_tls_handshake_seconds_total 0\n";
  EXPECT_THAT(took(), HasSubstr(nothing));
  // The clock of the thread may be coarse, so that some steps seem to take no time.
  for (int n = 0; n < 1000 && took().find(nothing) != std::string::npos; ++n) {
    Tcp::socket& client = come("192.0.2.1");
    boost::asio::write(client, boost::asio::buffer(hello));
    EXPECT_TRUE(comes_true([&] {
      go_on();
      return client.available() > 0;
    }));
    parts.connections.each([](windsplat::transport::Connection& one) { one.abort(); });
    clients.clear();
  }
  EXPECT_THAT(took(), Not(HasSubstr(nothing)));
}

}  // namespace
}  // namespace server_test
