// Which pages of other origins may read answers.
#include "server/http/cors.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace windsplat::http {
namespace {

const std::vector<std::string> cors_friends{"https://friend.example"};

std::string cors_header(const Response& response, const std::string& name) {
  for (const auto& [key, value] : response.headers) {
    if (key == name) return value;
  }
  return "absent";
}

Request cors_request(const std::string& method, const Headers& headers) {
  Request request;
  request.method = method;
  request.headers = headers;
  return request;
}

TEST(Cors, OriginsAreASchemeAHostAndPerhapsAPort) {
  for (const char* const good :
       {"https://a.example", "http://localhost:8080", "http://10.0.0.1", "http://[::1]:8080",
        "http://[::1]", "chrome-extension://abcdef", "https://a_b.example:65535"}) {
    EXPECT_TRUE(is_origin(good)) << good;
  }
  for (const char* const bad :
       {"", "*", "null", "a.example", "https://", "https://a.example/", "https://a.example/page",
        "https://*.a.example", "https://a.example:", "https://a.example:0",
        "https://a.example:65536", "https://[::1", "https://a.example https://b.example",
        "https://a.example\r\nX: y", "1http://a.example", "://a.example"}) {
    EXPECT_FALSE(is_origin(bad)) << bad;
  }
}

TEST(Cors, APreflightNamesAMethodAndComesFromAListedOrigin) {
  const Headers asked{{"Origin", "https://friend.example"},
                      {"Access-Control-Request-Method", "POST"}};
  EXPECT_TRUE(is_preflight(cors_request("OPTIONS", asked), cors_friends));
  EXPECT_FALSE(is_preflight(cors_request("POST", asked), cors_friends));
  EXPECT_FALSE(is_preflight(cors_request("OPTIONS", {asked[0]}), cors_friends));
  EXPECT_FALSE(is_preflight(cors_request("OPTIONS", {asked[1]}), cors_friends));
  EXPECT_FALSE(is_preflight(cors_request("OPTIONS", asked), {}));
  EXPECT_FALSE(is_preflight(cors_request("OPTIONS", {asked[0], asked[0], asked[1]}), cors_friends))
      << "two origins are none";
  EXPECT_FALSE(is_preflight(cors_request("OPTIONS", asked), {"https://friend.example:8443"}));
}

TEST(Cors, OnlyListedOriginsMayReadAndCookiesAreNeverAllowed) {
  Response shared;
  shared.headers = {{"Vary", "Accept-Encoding"}};
  share_with_origins(shared, cors_request("GET", {{"Origin", "https://Friend.example"}}),
                     cors_friends);
  EXPECT_EQ(cors_header(shared, "Access-Control-Allow-Origin"), "https://Friend.example")
      << "browsers compare it with what they sent";
  EXPECT_EQ(cors_header(shared, "Vary"), "Accept-Encoding, Origin");
  EXPECT_EQ(cors_header(shared, "Access-Control-Allow-Credentials"), "absent");
  Response foreign;
  share_with_origins(foreign, cors_request("GET", {{"Origin", "https://evil.example"}}),
                     cors_friends);
  EXPECT_EQ(cors_header(foreign, "Access-Control-Allow-Origin"), "absent");
  EXPECT_EQ(cors_header(foreign, "Access-Control-Expose-Headers"), "absent");
  EXPECT_EQ(cors_header(foreign, "Vary"), "Origin");
  Response without;
  share_with_origins(without, cors_request("GET", {{"Origin", "https://friend.example"}}), {});
  EXPECT_TRUE(without.headers.empty());
}

TEST(Cors, VaryNamesEachHeaderOnce) {
  Response response;
  add_vary(response, "Origin");
  add_vary(response, "accept-encoding");
  add_vary(response, "origin");
  add_vary(response, "Accept-Encoding");
  EXPECT_EQ(cors_header(response, "Vary"), "Origin, accept-encoding");
}

}  // namespace
}  // namespace windsplat::http
