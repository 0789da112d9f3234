// State of sockets: detection of a closed peer, and rejection of connections when descriptors run
// out.
#include "server/transport/peer.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <vector>

#include "server/transport/spare_descriptor.hpp"

namespace windsplat::transport {
namespace {

class Listening {
 public:
  Listening() : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0)) {
    at_.sin_family = AF_INET;
    at_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at_;
    EXPECT_EQ(::bind(socket_, address(), size), 0);
    EXPECT_EQ(::listen(socket_, 8), 0);
    EXPECT_EQ(::getsockname(socket_, address(), &size), 0);
  }
  ~Listening() { ::close(socket_); }
  Listening(const Listening&) = delete;
  Listening& operator=(const Listening&) = delete;

  [[nodiscard]] int socket() const { return socket_; }
  int connect() {
    const int client = ::socket(AF_INET, SOCK_STREAM, 0);
    EXPECT_EQ(::connect(client, address(), sizeof at_), 0);
    return client;
  }

 private:
  sockaddr* address() { return reinterpret_cast<sockaddr*>(&at_); }

  int socket_;
  sockaddr_in at_{};
};

bool comes_true(const std::function<bool()>& holds) {
  for (int turn = 0; turn < 1000; ++turn) {
    if (holds()) return true;
    ::usleep(10'000);
  }
  return false;
}

TEST(Peer, HasDisconnectedWhenItClosesEvenWithUnreadBytes) {
  Listening listening;
  for (const bool byte_first : {false, true}) {
    for (const bool half : {false, true}) {
      const int client = listening.connect();
      const int server = ::accept(listening.socket(), nullptr, nullptr);
      ASSERT_GE(server, 0);
      EXPECT_FALSE(peer_has_left(server));
      if (byte_first) {
        EXPECT_EQ(::send(client, "G", 1, 0), 1);
      }
      EXPECT_FALSE(peer_has_left(server));
      half ? ::shutdown(client, SHUT_WR) : ::close(client);
      EXPECT_TRUE(comes_true([&] { return peer_has_left(server); })) << byte_first << half;
      if (half) ::close(client);
      ::close(server);
    }
  }
  EXPECT_TRUE(peer_has_left(-1));
}

TEST(SpareDescriptor, RefusesAClientWhenDescriptorsRunOut) {
  Listening listening;
  SpareDescriptor spare;
  EXPECT_FALSE(spare.turn_away(listening.socket())) << "no pending connection";
  const int client = listening.connect();
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit few{static_cast<rlim_t>(client) + 8, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  std::vector<int> taken;
  for (int one = 0; (one = ::open("/dev/null", O_RDONLY)) >= 0;) taken.push_back(one);
  EXPECT_EQ(::accept(listening.socket(), nullptr, nullptr), -1);
  EXPECT_EQ(errno, EMFILE);
  EXPECT_TRUE(spare.turn_away(listening.socket()));
  char byte = 0;
  EXPECT_LE(::recv(client, &byte, 1, 0), 0) << "closed at once";
  EXPECT_EQ(::open("/dev/null", O_RDONLY), -1) << "the spare descriptor is reopened";
  for (const int one : taken) ::close(one);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  ::close(client);
}

}  // namespace
}  // namespace windsplat::transport
