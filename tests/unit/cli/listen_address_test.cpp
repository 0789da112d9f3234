// The texts of --listen.
#include "server/cli/serve/listen_address.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace windsplat::cli {
namespace {

api::ListenPlace listen_place(const std::string& text) {
  const auto listen = parse_listen_place(text);
  EXPECT_TRUE(listen) << text;
  return listen ? listen->places.front() : api::ListenPlace{};
}

TEST(ListenAddress, IsNumericANameOrAUnixSocket) {
  EXPECT_EQ(listen_place(":0").address, "127.0.0.1");
  EXPECT_EQ(listen_place("10.0.0.1:81").address, "10.0.0.1");
  EXPECT_EQ(listen_place("10.0.0.1:81").port, 81);
  EXPECT_EQ(listen_place("[::1]:82").address, "::1");
  EXPECT_EQ(listen_place("unix:/run/a:b.sock").path, "/run/a:b.sock");
  EXPECT_TRUE(parse_listen_place("[::1]:82")->loopback);
  EXPECT_TRUE(parse_listen_place("unix:/run/a.sock")->loopback);
  EXPECT_FALSE(parse_listen_place("0.0.0.0:1")->loopback);
  for (const char* const bad :
       {"", "8080", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "300.0.0.1:1", "[127.0.0.1]:1",
        "::1:80", "a b:80", "unix:", "unix:a.sock", "name:80x"}) {
    const auto none = parse_listen_place(bad);
    ASSERT_FALSE(none) << bad;
    EXPECT_EQ(none.error().kind, ErrorKind::malformed) << bad;
  }
}

TEST(ListenAddress, ANameStandsForAllItsAddressesTheOlderProtocolFirst) {
  const auto local = parse_listen_place("localhost:8080");
  ASSERT_TRUE(local);
  EXPECT_TRUE(local->loopback);
  EXPECT_EQ(local->places.front().address, "127.0.0.1");
  for (const api::ListenPlace& place : local->places) {
    EXPECT_EQ(place.port, 8080);
    EXPECT_TRUE(place.may_lack);
    EXPECT_EQ(std::count_if(local->places.begin(), local->places.end(),
                            [&](const auto& other) { return other.address == place.address; }),
              1);
  }
  const auto none = parse_listen_place("no-such-name.invalid:8080");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::invalid);
}

TEST(ListenAddress, SeveralAreReachableFromElsewhereIfOneIs) {
  const auto listen = listen_places({":1", "unix:/run/a.sock"}, "0600");
  ASSERT_TRUE(listen);
  EXPECT_TRUE(listen->loopback);
  EXPECT_EQ(listen->places.size(), 2U);
  EXPECT_EQ(listen->places[1].mode, 0600U);
  EXPECT_FALSE(listen_places({":1", "0.0.0.0:2"}, "0660")->loopback);
  for (const char* const bad : {"", "66", "0888", "1777", "rw-"}) {
    EXPECT_FALSE(listen_places({":1"}, bad)) << bad;
  }
}

}  // namespace
}  // namespace windsplat::cli
