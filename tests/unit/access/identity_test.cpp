// Users whom a trusted proxy names.
#include "server/access/identity.hpp"

#include <gtest/gtest.h>

#include "server/access/admission.hpp"

namespace windsplat::access {
namespace {

http::Request request_of(http::Headers headers) {
  http::Request request;
  request.headers = std::move(headers);
  return request;
}

TEST(Identity, IsTheOnlyValueOfTheHeader) {
  EXPECT_EQ(*named_user(request_of({{"x-forwarded-user", " ada "}}), "X-Forwarded-User"), "ada");
  EXPECT_EQ(*named_user(request_of({{"X-User", "Doe, Jane"}}), "X-User"), "Doe, Jane");
  EXPECT_EQ(*named_user(request_of({{"X-Forwarded-Email", "ada"}}), "X-Forwarded-User"), "");
  EXPECT_EQ(*named_user(request_of({{"X-User", ""}}), "X-User"), "");
  const auto two = named_user(request_of({{"X-User", "eve"}, {"x-user", "ada"}}), "X-User");
  ASSERT_FALSE(two);
  EXPECT_NE(two.error().message.find("several headers X-User"), std::string::npos);
}

TEST(Identity, HasABoundedLength) {
  EXPECT_TRUE(named_user(request_of({{"X-User", std::string(user_bytes_max, 'a')}}), "X-User"));
  const auto longer =
      named_user(request_of({{"X-User", std::string(user_bytes_max + 1, 'a')}}), "X-User");
  ASSERT_FALSE(longer);
  EXPECT_NE(longer.error().message.find("129 bytes; at most 128"), std::string::npos);
}

TEST(Identity, HeadersHaveNamesOfHttp) {
  EXPECT_TRUE(is_field_name("X-Forwarded-User"));
  for (const char* wrong : {"", "X User", "X-User:", "X\n", "Benutzer\xc3\xbc"}) {
    EXPECT_FALSE(is_field_name(wrong)) << wrong;
  }
}

TEST(Identity, UsersAreCountedInPlaceOfAddresses) {
  Limits limits;
  limits.requests_per_address = 0.1;  // one, and no other within ten seconds
  limits.trusted_proxies = {"10.0.0.1"};
  limits.identity_header = "X-Forwarded-User";
  metrics::Metrics metrics;
  Admission admission(limits, metrics, [] { return 0; });
  const auto status = [&](const Visitor& visitor, http::Headers headers) {
    http::Request request = request_of(std::move(headers));
    const auto refusal = admission.request(visitor, request, false);
    return refusal ? refusal->status : 200;
  };
  const auto proxy = admission.connect("10.0.0.1");
  ASSERT_TRUE(proxy);
  const http::Headers::value_type from_a{"X-Forwarded-For", "198.51.100.1"};
  const http::Headers::value_type from_b{"X-Forwarded-For", "198.51.100.2"};
  EXPECT_EQ(status(*proxy, {from_a, {"X-Forwarded-User", "ada"}}), 200);
  EXPECT_EQ(status(*proxy, {from_b, {"X-Forwarded-User", "ada"}}), 429);
  EXPECT_EQ(status(*proxy, {from_a, {"X-Forwarded-User", "bob"}}), 200);
  EXPECT_EQ(status(*proxy, {from_a}), 200) << "an address is no user";
  EXPECT_EQ(status(*proxy, {from_a}), 429);
  EXPECT_EQ(status(*proxy, {{"X-Forwarded-User", "198.51.100.1"}}), 200)
      << "a user with the name of an address";
  EXPECT_EQ(status(*proxy, {{"X-Forwarded-User", "eve"}, {"X-Forwarded-User", "ada"}}), 400);
}

TEST(Identity, OthersCannotNameAUser) {
  Limits limits;
  limits.trusted_proxies = {"10.0.0.1"};
  limits.identity_header = "X-Forwarded-User";
  metrics::Metrics metrics;
  Admission admission(limits, metrics, [] { return 0; });
  const auto liar = admission.connect("203.0.113.9");
  ASSERT_TRUE(liar);
  http::Request request = request_of({{"X-Forwarded-User", "ada"}});
  EXPECT_FALSE(admission.request(*liar, request, false));
  EXPECT_EQ(request.address, "203.0.113.9");
}

}  // namespace
}  // namespace windsplat::access
