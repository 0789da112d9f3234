// gzip of answers and request bodies.
#include "server/http/gzip.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace windsplat::http {
namespace {

using std::string_view_literals::operator""sv;

// Output of `printf hello | gzip -n`.
constexpr std::string_view gzip_hello =
    "\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03\xcb\x48\xcd\xc9\xc9\x07\x00\x86\xa6\x10\x36"
    "\x05\x00\x00\x00"sv;

Response gzip_answer(const std::string& type, std::size_t bytes) {
  Response response;
  response.content_type = type;
  response.body = Body::of(std::string(bytes, 'x'));
  return response;
}

std::string gzip_header(const Response& response, const std::string& name) {
  for (const auto& [key, value] : response.headers) {
    if (key == name) return value;
  }
  return "";
}

std::string gzip_text(const Response& response) {
  return {response.body.bytes.begin(), response.body.bytes.end()};
}

Request gzip_request(const std::string& coding, std::string_view body) {
  Request request;
  request.method = "POST";
  request.headers = {{"Content-Encoding", coding}};
  request.body = body;
  return request;
}

TEST(Gzip, UnpacksWhatAnotherProgramPacked) {
  EXPECT_EQ(ungzip(gzip_hello, 5).value(), "hello");
  EXPECT_EQ(ungzip(gzip_hello, 4).error().kind, ErrorKind::too_large);
}

TEST(Gzip, RefusesWhatIsNoGzip) {
  const std::string hello(gzip_hello);
  std::string damaged = hello;
  damaged[15] = '\x55';
  for (const std::string& bad : {std::string(), std::string("hello"), hello.substr(0, 12),
                                 hello.substr(0, hello.size() - 1), hello + "x", damaged}) {
    const auto text = ungzip(bad, 100);
    ASSERT_FALSE(text) << bad.size();
    EXPECT_EQ(text.error().kind, ErrorKind::malformed);
  }
}

TEST(Gzip, UnpackingStopsAtTheLimit) {
  Response zeros = gzip_answer("text/plain", std::size_t{10} << 20);
  compress(zeros);
  ASSERT_LT(zeros.body.bytes.size(), 20000U);
  std::string packed = gzip_text(zeros);
  EXPECT_EQ(ungzip(packed, 65536).error().kind, ErrorKind::too_large);
  EXPECT_EQ(ungzip(packed, std::size_t{10} << 20).value().size(), std::size_t{10} << 20);
  // A damaged end is not met before the limit.
  packed.back() ^= 1;
  EXPECT_EQ(ungzip(packed, 65536).error().kind, ErrorKind::too_large);
  EXPECT_EQ(ungzip(packed, std::size_t{10} << 20).error().kind, ErrorKind::malformed);
}

TEST(Gzip, IsForLargerTextOnly) {
  for (const char* const type :
       {"application/json", "application/problem+json", "application/schema+json",
        "text/html; charset=utf-8", "text/plain; version=0.0.4; charset=utf-8", "image/svg+xml"}) {
    EXPECT_TRUE(is_compressible(gzip_answer(type, 1024))) << type;
    EXPECT_FALSE(is_compressible(gzip_answer(type, 1023))) << type;
  }
  for (const char* const type :
       {"image/jpeg", "image/png", "application/pdf", "application/octet-stream", ""}) {
    EXPECT_FALSE(is_compressible(gzip_answer(type, 4096))) << type;
  }
  Response coded = gzip_answer("text/html", 4096);
  coded.headers = {{"Content-Encoding", "gzip"}};
  EXPECT_FALSE(is_compressible(coded)) << "once is enough";
}

TEST(Gzip, TheCompressedFormHasATagOfItsOwn) {
  Response response = gzip_answer("application/json", 4096);
  response.headers = {{"ETag", "\"abc\""}};
  compress(response);
  EXPECT_EQ(gzip_header(response, "Content-Encoding"), "gzip");
  EXPECT_EQ(gzip_header(response, "ETag"), "\"abc-gzip\"");
  EXPECT_EQ(ungzip(gzip_text(response), 4096).value(), std::string(4096, 'x'));
}

TEST(Gzip, WhatDoesNotBecomeSmallerIsSentAsItIs) {
  std::string noise;
  std::uint32_t state = 1;
  for (int n = 0; n < 2000; ++n) {
    state = state * 1664525U + 1013904223U;
    noise += static_cast<char>(state >> 24U);
  }
  Response response;
  response.headers = {{"ETag", "\"abc\""}};
  response.body = Body::of(noise);
  compress(response);
  EXPECT_EQ(gzip_text(response), noise);
  EXPECT_EQ(gzip_header(response, "Content-Encoding"), "");
  EXPECT_EQ(gzip_header(response, "ETag"), "\"abc\"");
}

TEST(Gzip, BodiesOfRequestsAreUnpackedOrRefusedWith415) {
  Request packed = gzip_request("GZip", gzip_hello);
  EXPECT_FALSE(check_coding(packed));
  EXPECT_FALSE(decode_body(packed));
  EXPECT_EQ(packed.body, "hello");
  Request none = gzip_request("gzip", "{}");
  EXPECT_FALSE(check_coding(none)) << "known when the body is there";
  const auto refused = decode_body(none);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->status, 415);
  EXPECT_EQ(gzip_header(*refused, "Accept-Encoding"), "gzip");
  for (const char* const coding : {"br", "deflate", "gzip, gzip", "gzip, br", "zstd"}) {
    const auto unknown = check_coding(gzip_request(coding, "{}"));
    ASSERT_TRUE(unknown) << coding;
    EXPECT_EQ(unknown->status, 415);
    EXPECT_EQ(gzip_header(*unknown, "Accept-Encoding"), "gzip");
  }
  Request plain = gzip_request("identity", "{}");
  EXPECT_FALSE(check_coding(plain));
  EXPECT_FALSE(decode_body(plain));
  EXPECT_EQ(plain.body, "{}");
  Response large = gzip_answer("text/plain", 65537);
  compress(large);
  Request bomb = gzip_request("gzip", gzip_text(large));
  EXPECT_EQ(decode_body(bomb)->status, 413);
}

}  // namespace
}  // namespace windsplat::http
