// Address keys of the quotas, and trusted proxies.
#include "server/access/address.hpp"

#include <gtest/gtest.h>

namespace windsplat::access {
namespace {

TEST(Address, CountsIpv4WholeAndIpv6ByTheFirst64Bits) {
  EXPECT_EQ(counted_address("192.0.2.1"), "192.0.2.1");
  EXPECT_EQ(counted_address("::ffff:192.0.2.1"), "192.0.2.1");
  EXPECT_EQ(counted_address("2001:db8:1:2:3:4:5:6"), "2001:db8:1:2::/64");
  EXPECT_EQ(counted_address("2001:db8:1:2::1"), counted_address("2001:db8:1:2:ffff::"));
  EXPECT_NE(counted_address("2001:db8:1:2::1"), counted_address("2001:db8:1:3::1"));
  EXPECT_EQ(counted_address("fe80::1%eth0"), "fe80::/64");
  EXPECT_EQ(counted_address("::1"), "::/64");
  EXPECT_EQ(counted_address(""), "");
  EXPECT_LE(counted_address(std::string(100'000, 'x')).size(), 64U);
}

TEST(Network, ContainsAddressesWithItsPrefix) {
  const auto holds = [](const char* network, const char* address) {
    const auto parsed = Network::parse(network);
    EXPECT_TRUE(parsed) << network;
    return parsed && parsed->holds(address);
  };
  EXPECT_TRUE(holds("10.0.0.1", "10.0.0.1"));
  EXPECT_TRUE(holds("10.0.0.1", "::ffff:10.0.0.1"));
  EXPECT_FALSE(holds("10.0.0.1", "10.0.0.2"));
  EXPECT_TRUE(holds("172.16.0.0/12", "172.31.255.255"));
  EXPECT_FALSE(holds("172.16.0.0/12", "172.32.0.0"));
  EXPECT_FALSE(holds("172.16.0.0/12", "2001:db8::1"));
  EXPECT_TRUE(holds("2001:db8::/33", "2001:db8:7fff::1"));
  EXPECT_FALSE(holds("2001:db8::/33", "2001:db8:8000::1"));
  EXPECT_TRUE(holds("0.0.0.0/0", "203.0.113.1"));
  EXPECT_FALSE(holds("0.0.0.0/0", "2001:db8::1"));
  EXPECT_TRUE(holds("::/0", "2001:db8::1"));
  for (const char* wrong : {"", "proxy", "10.0.0.0/33", "2001:db8::/129", "10.0.0.0/", "10.0.0.0/x",
                            "10.0.0.0/8/8", "10.0.0.0/-1", "10.0.0.0/4294967295", "fe80::1%eth0"}) {
    EXPECT_FALSE(Network::parse(wrong)) << wrong;
  }
}

TEST(ClientAddress, IsTheLastHopThatIsNoTrustedProxy) {
  const std::vector<Network> trusted{*Network::parse("10.0.0.0/8"), *Network::parse("192.0.2.7")};
  const auto client = [&](const char* peer, const char* hops) {
    return client_address(peer, hops, trusted);
  };
  EXPECT_EQ(client("10.0.0.1", "198.51.100.1"), "198.51.100.1");
  // Entries claimed by the client precede those added by the proxy.
  EXPECT_EQ(client("10.0.0.1", "1.1.1.1, 198.51.100.1"), "198.51.100.1");
  EXPECT_EQ(client("10.0.0.1", "1.1.1.1,198.51.100.1 ,\t192.0.2.7, 10.9.9.9"), "198.51.100.1");
  EXPECT_EQ(client("10.0.0.1", "198.51.100.1:4711"), "198.51.100.1");
  EXPECT_EQ(client("10.0.0.1", "[2001:db8::1]:443"), "2001:db8::1");
  EXPECT_EQ(client("10.0.0.1", "2001:db8::1"), "2001:db8::1");
  // Without a valid header the address is that of the proxy.
  for (const char* hops : {"", ",", "unknown", "198.51.100.1, _hidden", "[", "[]", "1.2.3", ":"}) {
    EXPECT_EQ(client("10.0.0.1", hops), "10.0.0.1") << hops;
  }
  EXPECT_EQ(client("10.0.0.1", "10.2.2.2, 10.1.1.1"), "10.2.2.2");
  // The header is ignored from untrusted peers.
  EXPECT_EQ(client("203.0.113.9", "198.51.100.1"), "203.0.113.9");
  EXPECT_EQ(client("", "198.51.100.1"), "");
}

}  // namespace
}  // namespace windsplat::access
