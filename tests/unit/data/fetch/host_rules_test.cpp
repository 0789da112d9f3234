// Permitted hosts, and the addresses of the registries of special-purpose addresses.
#include "server/data/fetch/host_rules.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/un.h>

#include <cstring>
#include <string>

namespace windsplat::data::fetch {
namespace {

using testing::HasSubstr;
using testing::Not;

sockaddr_storage address_of(const std::string& text) {
  sockaddr_storage out{};
  sockaddr_in four{};
  sockaddr_in6 six{};
  if (::inet_pton(AF_INET, text.c_str(), &four.sin_addr) == 1) {
    four.sin_family = AF_INET;
    std::memcpy(&out, &four, sizeof four);
  } else {
    EXPECT_EQ(::inet_pton(AF_INET6, text.c_str(), &six.sin6_addr), 1) << text;
    six.sin6_family = AF_INET6;
    std::memcpy(&out, &six, sizeof six);
  }
  return out;
}

Reach reach(const std::string& text) {
  const sockaddr_storage address = address_of(text);
  return reach_of(reinterpret_cast<const sockaddr*>(&address));
}

TEST(HostAddresses, FirstAndLastAddressOfEachRangeBelongToIt) {
  for (const char* text : {"10.0.0.0", "10.255.255.255", "127.0.0.1", "127.255.255.255",
                           "172.16.0.0", "172.31.255.255", "192.168.0.0", "192.168.255.255",
                           "100.64.0.0", "100.127.255.255", "::1", "fc00::", "fdff:ffff::1"}) {
    EXPECT_EQ(reach(text), Reach::site) << text;
  }
  for (const char* text : {"0.0.0.0",
                           "0.255.255.255",
                           "169.254.0.1",
                           "169.254.169.254",
                           "169.254.255.255",
                           "100.100.100.200",
                           "192.0.0.192",
                           "192.0.2.1",
                           "192.88.99.1",
                           "198.18.0.0",
                           "198.19.255.255",
                           "198.51.100.9",
                           "203.0.113.7",
                           "224.0.0.1",
                           "240.0.0.1",
                           "255.255.255.255",
                           "::",
                           "fe80::1",
                           "fec0::1",
                           "ff02::1",
                           "fd00:ec2::254",
                           "2001:db8::1",
                           "2001::1",
                           "100::1",
                           "::127.0.0.1",
                           "4000::1"}) {
    EXPECT_EQ(reach(text), Reach::never) << text;
  }
  for (const char* text :
       {"1.1.1.1", "9.255.255.255", "11.0.0.0", "126.255.255.255", "128.0.0.0", "172.15.255.255",
        "172.32.0.0", "192.167.255.255", "192.169.0.0", "100.63.255.255", "100.128.0.0",
        "169.253.255.255", "169.255.0.0", "198.17.255.255", "198.20.0.0", "223.255.255.255",
        "2606:4700::1111", "2001:200::1", "2a00::1"}) {
    EXPECT_EQ(reach(text), Reach::everyone) << text;
  }
}

TEST(HostAddresses, AnIPv4AddressWithinAnIPv6AddressDecides) {
  EXPECT_EQ(reach("::ffff:8.8.8.8"), Reach::everyone);
  EXPECT_EQ(reach("::ffff:127.0.0.1"), Reach::site);
  EXPECT_EQ(reach("::ffff:169.254.169.254"), Reach::never);
  EXPECT_EQ(reach("64:ff9b::10.0.0.1"), Reach::site);
  EXPECT_EQ(reach("64:ff9b::a9fe:a9fe"), Reach::never);
  EXPECT_EQ(reach("2002:7f00:1::"), Reach::site);
  EXPECT_EQ(reach("2002:a9fe:a9fe::1"), Reach::never);
}

TEST(HostAddresses, SocketsOfThisMachineAreNeverPermitted) {
  sockaddr_un local{};
  local.sun_family = AF_UNIX;
  EXPECT_EQ(reach_of(reinterpret_cast<const sockaddr*>(&local)), Reach::never);
}

TEST(HostAddresses, TheOptionPermitsSitesAndNothingElse) {
  const auto permits = [](bool sites, const std::string& text) {
    const sockaddr_storage address = address_of(text);
    return HostRules::parse({"h"}, sites)->permits(reinterpret_cast<const sockaddr*>(&address));
  };
  EXPECT_TRUE(permits(false, "8.8.8.8"));
  EXPECT_FALSE(permits(false, "192.168.1.1"));
  EXPECT_TRUE(permits(true, "192.168.1.1"));
  EXPECT_FALSE(permits(true, "169.254.169.254"));
}

TEST(HostList, SchemeHostAndPortMustAllBePermitted) {
  const auto rules = HostRules::parse({"Data.Example", "http://plain.example", "h:8443"}, false);
  ASSERT_TRUE(rules) << rules.error().message;
  const auto permitted = [&](const std::string& url) {
    return rules->check(parse_url(url).value()).has_value();
  };
  EXPECT_TRUE(permitted("https://data.example/x"));
  EXPECT_TRUE(permitted("https://data.example:443/x"));
  EXPECT_TRUE(permitted("http://plain.example/x"));
  EXPECT_TRUE(permitted("https://h:8443/x"));
  EXPECT_FALSE(permitted("http://data.example/x"));
  EXPECT_FALSE(permitted("https://data.example:8443/x"));
  EXPECT_FALSE(permitted("https://plain.example/x"));
  EXPECT_FALSE(permitted("https://h/x"));
  EXPECT_FALSE(permitted("https://sub.data.example/x"));
  EXPECT_FALSE(permitted("https://data.example.evil/x"));
  EXPECT_THAT(rules->check(parse_url("https://other/secret/x.nc").value()).error().message,
              testing::AllOf(HasSubstr("https://other"), HasSubstr("--data-host"),
                             Not(HasSubstr("secret"))));
  EXPECT_FALSE(HostRules().check(parse_url("https://h/x").value()));
}

TEST(HostList, ARefusalNamesTheOptionForTheOtherScheme) {
  const auto rules = HostRules::parse({"data.example:8000", "http://plain.example"}, false);
  ASSERT_TRUE(rules);
  const auto why = [&](const std::string& url) {
    return rules->check(parse_url(url).value()).error().message;
  };
  EXPECT_THAT(why("http://data.example:8000/x"),
              HasSubstr("--data-host data.example:8000 permits https, --data-host "
                        "http://data.example:8000 unencrypted http"));
  EXPECT_THAT(why("https://plain.example/x"),
              HasSubstr("--data-host http://plain.example permits unencrypted http, --data-host "
                        "plain.example https"));
  EXPECT_THAT(why("https://other.example/x"), Not(HasSubstr("permits")));
}

TEST(HostList, WhatIsNoHostIsRefused) {
  for (const char* text :
       {"", "s3://bucket", "https://h/path", "h/path", "h:0", "a b", "user:p@h"}) {
    EXPECT_FALSE(HostRules::parse({text}, false)) << text;
  }
}

}  // namespace
}  // namespace windsplat::data::fetch
