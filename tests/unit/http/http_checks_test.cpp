// Requests that HTTP allows and this server refuses, by their header only.
#include "server/http/http_checks.hpp"

#include <gtest/gtest.h>

#include "server/http/request_target.hpp"

namespace windsplat::http {
namespace {

int status_of(const std::optional<Response>& response) { return response ? response->status : 0; }

int status_of_line(const std::string& line) {
  return status_of(check_header_bytes(line + "\r\nHost: a\r\n\r\n"));
}

Request request_with(Headers headers) {
  Request request;
  request.method = "GET";
  request.headers = std::move(headers);
  return request;
}

TEST(HeaderBytes, RequestLineHasThreePartsWithAVersionLast) {
  for (const char* line :
       {"GET / HTTP/1.1", "GET / HTTP/9.0", "X * HTTP/1.0", "GET http://a/b?c HTTP/1.1"}) {
    EXPECT_EQ(status_of_line(line), 0) << line;
  }
  for (const char* line :
       {"", "GET", "GET /", "GET  HTTP/1.1", " / HTTP/1.1", "GET / x HTTP/1.1", "GET  / HTTP/1.1",
        "GET /  HTTP/1.1", "GET / HTTP/1.1 ", "GET\t/ HTTP/1.1", "GET /\ta HTTP/1.1",
        "GET / HTTP 1.1", "GET / http/1.1", "GET / HTP/1.1", "GET / HTTP/11", "GET / HTTP/1.10",
        "GET / HTTP/x.1", "GET / HTTP/1,1"}) {
    EXPECT_EQ(status_of_line(line), 400) << line;
  }
}

TEST(HeaderBytes, LineEndsAreCrlfWithoutFolding) {
  const std::string line = "GET / HTTP/1.1\r\n";
  EXPECT_EQ(status_of(check_header_bytes(line + "A: 1\r\nB: 2\r\n\r\n")), 0);
  for (const char* rest : {"A: 1\nB: 2\r\n\r\n", "A: 1\rB: 2\r\n\r\n", "A: 1\r\r\n\r\n",
                           "A: 1\r\n B\r\n\r\n", "A: 1\r\n\tB\r\n\r\n"}) {
    EXPECT_EQ(status_of(check_header_bytes(line + rest)), 400) << rest;
  }
}

TEST(RequestCheck, HostIsANameOrAddressWithOptionalPort) {
  for (const char* host : {"a", "a.example", "a-b_c~d.example:80", "127.0.0.1", "127.0.0.1:65535",
                           "[::1]", "[2001:db8::1]:8080", "[::ffff:1.2.3.4]", "a:", "%41"}) {
    EXPECT_EQ(status_of(check_request(request_with({{"Host", host}}), 11)), 0) << host;
  }
  for (const char* host :
       {"",     ":80",    "a:b",     "a:65536", "a:123456", "a:1:2",    "u@a",   "a:80@b",
        "a/b",  "a?b",    "a#b",     "a, b",    "a b",      "a\\b",     "\"a\"", "[]",
        "[::1", "[::1]a", "[::1]:x", "[a/b]",   "::1",      "http://a", "\xe4"}) {
    EXPECT_EQ(status_of(check_request(request_with({{"Host", host}}), 11)), 400) << host;
  }
  EXPECT_EQ(status_of(check_request(request_with({}), 11)), 400);
  EXPECT_EQ(status_of(check_request(request_with({{"Host", "a"}, {"HOST", "a"}}), 11)), 400);
}

Headers upgrade_headers() {
  return {{"Host", "a"},
          {"Connection", "Upgrade"},
          {"Upgrade", "websocket"},
          {"Sec-WebSocket-Version", "13"},
          {"Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="}};
}

TEST(Upgrade, IsRequestedByListsInAnyNumberOfLines) {
  Request request = request_with(upgrade_headers());
  EXPECT_TRUE(asks_for_websocket(request, 11));
  EXPECT_FALSE(asks_for_websocket(request, 10));
  request.headers[1].second = "keep-alive";
  EXPECT_FALSE(asks_for_websocket(request, 11));
  request.headers.emplace_back("connection", "foo ,UPGRADE");
  EXPECT_TRUE(asks_for_websocket(request, 11));
  request.headers[2].second = "websocket2";
  EXPECT_FALSE(asks_for_websocket(request, 11));
  request.headers.emplace_back("upgrade", "h2c, WebSocket");
  EXPECT_TRUE(asks_for_websocket(request, 11));
  request.method = "POST";
  EXPECT_FALSE(asks_for_websocket(request, 11));
}

TEST(Upgrade, NeedsAKeyOf16BytesOnce) {
  Request request = request_with(upgrade_headers());
  EXPECT_EQ(status_of(check_upgrade(request)), 0);
  std::string& key = request.headers[4].second;
  for (const char* bad : {"", "hello", "dGhlIHNhbXBsZSBub25jZQ", "dGhlIHNhbXBsZSBub25jZQ=",
                          "AAAAAAAAAAAAAAAAAAAAAAA=", "AAAAAAAAAAAAAAAAAAAAAAAA",
                          "AAAA AAAAAAAAAAAAAAAAA==", "_-_-_-_-_-_-_-_-_-_-_-=="}) {
    key = bad;
    EXPECT_EQ(status_of(check_upgrade(request)), 400) << bad;
  }
  key = "+/AAAAAAAAAAAAAAAAAAAA==";
  EXPECT_EQ(status_of(check_upgrade(request)), 0);
  request.headers.emplace_back("Sec-WebSocket-Key", key);
  EXPECT_EQ(status_of(check_upgrade(request)), 400);
  request.headers.resize(4);
  EXPECT_EQ(status_of(check_upgrade(request)), 400);
}

TEST(Upgrade, OtherVersionGetsTheSupportedOne) {
  for (const char* version : {"", "8", "12", "14", "013", "13, 8", "+13"}) {
    Request request = request_with(upgrade_headers());
    request.headers[3].second = version;
    const auto refused = check_upgrade(request);
    ASSERT_EQ(status_of(refused), 426) << version;
    const auto& headers = refused->headers;
    EXPECT_NE(std::find(headers.begin(), headers.end(),
                        std::pair<std::string, std::string>("Sec-WebSocket-Version", "13")),
              headers.end());
  }
}

// Path and query of a target, joined; empty if it is refused.
std::string told(std::string_view target, const char* host) {
  Request request = request_with({{"Host", host}});
  if (!parse_target(target, "/", request)) return "";
  std::string out;
  for (const std::string& segment : request.path) out += '/' + segment;
  for (const auto& [name, value] : request.query) out += '?' + name + '=' + value;
  return out;
}

TEST(Target, AbsoluteFormNamesTheRequestedHost) {
  EXPECT_EQ(told("/a/b?c=/d", "h:1"), "/a/b?c=/d");
  EXPECT_EQ(told("http://h:1/a/b?c=/d", "h:1"), "/a/b?c=/d");
  EXPECT_EQ(told("HTTPS://H/a", "h"), "/a");
  EXPECT_EQ(told("http://h?c=/d", "h"), "?c=/d");
  for (const char* target : {"http://other/a", "http://u@h/a", "http://h:2/a", "http:///a",
                             "http://h.evil/a", "ftp://h/a", "http:/h/a", "a"}) {
    EXPECT_EQ(told(target, "h"), "") << target;
  }
}

TEST(Target, WithoutQueryTextHasNoQuery) {
  EXPECT_EQ(told("/a?", "h"), "/a");
  EXPECT_EQ(told("/a?&&", "h"), "/a");
  EXPECT_EQ(told("/a?&b=1&", "h"), "/a?b=1");
  EXPECT_EQ(told("/a?=1", "h"), "/a?=1");
}

}  // namespace
}  // namespace windsplat::http
