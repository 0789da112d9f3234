// Files of UNIX sockets, and peers at them.
#include "server/transport/unix_socket.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "server/access/address.hpp"
#include "server/transport/peer.hpp"

namespace windsplat::transport {
namespace {

class UnixSockets : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "windsplat-unix-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder = name;
    path = folder / "a.sock";
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  [[nodiscard]] sockaddr_un address() const {
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    std::memcpy(at.sun_path, path.c_str(), path.size());
    return at;
  }
  [[nodiscard]] int bound() const {
    const int handle = ::socket(AF_UNIX, SOCK_STREAM, 0);
    const sockaddr_un at = address();
    EXPECT_EQ(::bind(handle, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    return handle;
  }
  [[nodiscard]] bool is_there() const { return std::filesystem::exists(path); }

  std::filesystem::path folder;
  std::string path;
};

TEST_F(UnixSockets, OnlyASocketThatNobodyAnswersIsStale) {
  EXPECT_TRUE(remove_stale_socket(path)) << "nothing is there";
  int handle = bound();
  ASSERT_EQ(::listen(handle, 1), 0);
  const auto used = remove_stale_socket(path);
  ASSERT_FALSE(used);
  EXPECT_NE(used.error().message.find("another process listens"), std::string::npos);
  EXPECT_TRUE(is_there());
  ::close(handle);
  EXPECT_TRUE(is_there()) << "left behind";
  EXPECT_TRUE(remove_stale_socket(path));
  EXPECT_FALSE(is_there());
  std::ofstream(path) << "keep";
  EXPECT_FALSE(remove_stale_socket(path));
  EXPECT_TRUE(is_there());
  EXPECT_FALSE(remove_stale_socket("/" + std::string(unix_path_bytes_max, 'x')));
}

TEST_F(UnixSockets, AFileGoesWithItsOwnerUnlessAnotherTookItsPlace) {
  const int first = bound();
  {
    UnixSocketFile file;
    ASSERT_TRUE(file.own(path, 0600));
    struct stat facts {};
    ASSERT_EQ(::stat(path.c_str(), &facts), 0);
    EXPECT_EQ(facts.st_mode & 0777U, 0600U);
  }
  EXPECT_FALSE(is_there());
  const int second = bound();
  int third = -1;
  {
    UnixSocketFile file;
    ASSERT_TRUE(file.own(path, 0600));
    std::filesystem::rename(path, folder / "moved.sock");
    third = bound();
  }
  EXPECT_TRUE(is_there()) << "the other's";
  for (const int handle : {first, second, third}) ::close(handle);
}

TEST_F(UnixSockets, PeersAreNamedByTheirUserAndSeenToLeave) {
  const int listening = bound();
  ASSERT_EQ(::listen(listening, 1), 0);
  const int client = ::socket(AF_UNIX, SOCK_STREAM, 0);
  const sockaddr_un at = address();
  ASSERT_EQ(::connect(client, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  const int served = ::accept(listening, nullptr, nullptr);
  EXPECT_EQ(peer_of(served), "unix:" + std::to_string(::getuid()));
  EXPECT_EQ(port_of(served), 0);
  EXPECT_FALSE(peer_has_left(served));
  EXPECT_EQ(::send(client, "x", 1, 0), 1);
  EXPECT_FALSE(peer_has_left(served)) << "bytes are no end";
  ::close(client);
  EXPECT_TRUE(peer_has_left(served)) << "even behind an unread byte";
  ::close(served);
  ::close(listening);
}

TEST(UnixUrl, HasTheEscapedPathAsItsHost) {
  EXPECT_EQ(unix_url("/run/w s/a_1.sock", "/winds/"),
            "http+unix://%2Frun%2Fw%20s%2Fa_1.sock/winds/");
}

TEST(UnixPeers, AreTrustedByNameOnlyAndClientsCannotClaimToBeOne) {
  const auto local = access::Network::parse("unix");
  ASSERT_TRUE(local);
  EXPECT_TRUE(local->holds("unix:1000"));
  EXPECT_FALSE(local->holds("127.0.0.1"));
  EXPECT_FALSE(access::Network::parse("0.0.0.0/0")->holds("unix:1000"));
  EXPECT_FALSE(access::Network::parse("unix:1000"));
  EXPECT_EQ(access::client_address("unix:33", "192.0.2.1", {*local}), "192.0.2.1");
  EXPECT_EQ(access::client_address("unix:33", "192.0.2.1", {}), "unix:33");
  EXPECT_EQ(access::client_address("unix:33", "unix:0", {*local}), "unix:33");
  EXPECT_EQ(access::counted_address("unix:33"), "unix:33");
}

}  // namespace
}  // namespace windsplat::transport
