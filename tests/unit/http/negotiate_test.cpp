// Accepted hosts of a request, and recognition of loopback names.
#include "server/http/negotiate.hpp"

#include <gtest/gtest.h>

namespace windsplat::http {
namespace {

TEST(HostNames, LoopbackHasThree) {
  for (const char* host : {"localhost", "LOCALHOST:8080", "127.0.0.1", "127.9.9.9:1", "[::1]:80"}) {
    EXPECT_TRUE(names_loopback(host)) << host;
  }
  for (const char* host : {"", "localhost.example", "127.0.0.1.example", "10.0.0.1", "[::2]"}) {
    EXPECT_FALSE(names_loopback(host)) << host;
  }
}

// A page can make its own name resolve to this machine, but not an address.
TEST(HostNames, AddressesAreNotHostNames) {
  for (const char* host : {"10.0.0.1", "10.0.0.1:8080", "[2001:db8::1]", "[::ffff:1.2.3.4]:80"}) {
    EXPECT_TRUE(is_address(host)) << host;
  }
  for (const char* host : {"", "evil.example", "10.0.0.1.example:80", "10.0.0", "10.0.0.256", "[]",
                           "[evil.example]", "[::1", "::1"}) {
    EXPECT_FALSE(is_address(host)) << host;
  }
}

TEST(HostNames, CanBeConfigured) {
  const std::vector<std::string> origins{"https://a.example"};
  const std::vector<std::string> names{"winds.example"};
  for (const char* host : {"localhost:1", "a.example", "winds.example", "WINDS.example:8080"}) {
    EXPECT_TRUE(local_host_allowed(host, origins, names)) << host;
  }
  for (const char* host : {"evil.example", "winds.example.evil", "x.winds.example", "10.0.0.1"}) {
    EXPECT_FALSE(local_host_allowed(host, origins, names)) << host;
  }
}

}  // namespace
}  // namespace windsplat::http
