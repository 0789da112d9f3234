// gzip over HTTP: answers to clients that accept it, conditional requests, request bodies.
#include <gmock/gmock.h>

#include "server/http/gzip.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;
using windsplat::http::ungzip;

const Headers accepts_zipped{{"Accept-Encoding", "gzip"}};

std::string zipped(const std::string& text) {
  windsplat::http::Response response;
  response.body = windsplat::http::Body::of(text + std::string(300, ' '));
  windsplat::http::compress(response);
  return {response.body.bytes.begin(), response.body.bytes.end()};
}

TEST(Compression, TextIsSentAsGzipToClientsThatAcceptIt) {
  const TestServer server;
  for (const char* const target :
       {"/v1", "/v1/datasets/small", "/view.schema.json", "/v1/colormaps"}) {
    const Answer plain = get(server.port(), target);
    ASSERT_EQ(plain.status, 200) << target;
    EXPECT_EQ(plain.header("content-encoding"), "") << target;
    EXPECT_EQ(plain.header("vary"), "Accept-Encoding") << target;
    const Answer packed = get(server.port(), target, accepts_zipped);
    EXPECT_EQ(packed.header("content-encoding"), "gzip") << target;
    EXPECT_EQ(packed.header("vary"), "Accept-Encoding") << target;
    EXPECT_LT(packed.body.size(), plain.body.size() / 2) << target;
    EXPECT_EQ(ungzip(packed.body, plain.body.size()).value(), plain.body) << target;
    Socket socket(server.port());
    socket.send("HEAD " + std::string(target) +
                " HTTP/1.1\r\nHost: x\r\nAccept-Encoding: gzip\r\n\r\n");
    const Answer head = read_answer(socket, true);
    EXPECT_EQ(head.header("content-encoding"), "gzip") << target;
    EXPECT_EQ(head.header("content-length"), packed.header("content-length")) << target;
    EXPECT_EQ(head.header("etag"), packed.header("etag")) << target;
  }
  EXPECT_EQ(get(server.port(), "/metrics", accepts_zipped).header("content-encoding"), "gzip");
}

TEST(Compression, ClientsThatRefuseItAndPicturesAndShortAnswersGetNone) {
  const TestServer server;
  for (const char* const refusal : {"gzip;q=0", "identity", "br, *;q=0", "gzip;q=0, *"}) {
    const Answer answer = get(server.port(), "/v1", {{"Accept-Encoding", refusal}});
    EXPECT_EQ(answer.header("content-encoding"), "") << refusal;
    EXPECT_EQ(json_of(answer)["name"], "windsplat") << refusal;
  }
  const char* const picture = "/v1/datasets/small/frame.png?width=64&height=64";
  EXPECT_EQ(get(server.port(), picture, accepts_zipped).header("content-encoding"), "");
  EXPECT_EQ(get(server.port(), "/livez", accepts_zipped).header("content-encoding"), "");
}

TEST(Compression, EachFormHasItsTagAndEitherPermitsAChange) {
  const TestServer server;
  const auto port = server.port();
  const Answer plain = get(port, "/view.schema.json");
  const Answer packed = get(port, "/view.schema.json", accepts_zipped);
  EXPECT_NE(plain.header("etag"), packed.header("etag"));
  const auto again = [&](const std::string& tag, bool gzip) {
    Headers headers{{"If-None-Match", tag}};
    if (gzip) headers.push_back(accepts_zipped[0]);
    return get(port, "/view.schema.json", headers);
  };
  for (const bool gzip : {false, true}) {
    const Answer& same = gzip ? packed : plain;
    const Answer known = again(same.header("etag"), gzip);
    EXPECT_EQ(known.status, 304);
    EXPECT_EQ(known.header("etag"), same.header("etag"));
    EXPECT_EQ(known.header("vary"), "Accept-Encoding");
  }
  EXPECT_EQ(again(packed.header("etag"), false).status, 200) << "it could not read that form";

  const std::string view = R"({"dataset":"small","scalars":[]})";
  const Answer saved = request(port, "POST", "/v1/views", json_type, view);
  ASSERT_EQ(saved.status, 201) << saved.body;
  const std::string at = saved.header("location");
  const Answer read = get(port, at, accepts_zipped);
  for (const std::string& tag :
       {read.header("etag"), windsplat::http::gzip_etag(read.header("etag"))}) {
    Headers headers = json_type;
    headers.emplace_back("If-Match", tag);
    const Answer changed = request(port, "PUT", at, headers, view);
    EXPECT_EQ(changed.status, 200) << tag << changed.body;
  }
}

// SVG is text. Browsers keep the headers of a 304, so it has those of the picture.
TEST(Compression, PicturesOfTextHaveATagForEachFormAndThoseOfBytesNone) {
  const TestServer server;
  const std::string target = "/v1/datasets/small/frame.svg?width=64&height=64";
  const Answer plain = get(server.port(), target);
  ASSERT_EQ(plain.status, 200) << plain.body;
  EXPECT_EQ(plain.header("content-encoding"), "");
  const Answer packed = get(server.port(), target, accepts_zipped);
  EXPECT_EQ(packed.header("content-encoding"), "gzip");
  EXPECT_EQ(packed.header("etag"), windsplat::http::gzip_etag(plain.header("etag")));
  EXPECT_EQ(ungzip(packed.body, plain.body.size()).value(), plain.body);
  for (const Answer* const form : {&plain, &packed}) {
    Headers asked = accepts_zipped;
    asked.emplace_back("If-None-Match", form->header("etag"));
    const Answer known = get(server.port(), target, asked);
    EXPECT_EQ(known.status, 304);
    for (const char* const name : {"etag", "vary", "cache-control", "cross-origin-resource-policy"})
      EXPECT_EQ(known.header(name), form->header(name)) << name;
    EXPECT_EQ(known.header("vary"), "Accept, Accept-Encoding");
  }
  EXPECT_EQ(get(server.port(), target, {{"If-None-Match", packed.header("etag")}}).status, 200)
      << "it could not read that form";
  const std::string bytes = "/v1/datasets/small/frame.png?width=64&height=64";
  const Answer png = get(server.port(), bytes, accepts_zipped);
  const Answer known = get(server.port(), bytes, {{"If-None-Match", png.header("etag")}});
  EXPECT_EQ(known.status, 304);
  EXPECT_EQ(png.header("vary"), "Accept");
  EXPECT_EQ(known.header("vary"), "Accept");
  EXPECT_EQ(known.header("cross-origin-resource-policy"), "cross-origin");
}

TEST(Compression, RequestBodiesMayBeGzip) {
  const TestServer server;
  const std::string view = R"({"dataset":"small","image":{"width":16,"height":16}})";
  const auto status = [&](const std::string& coding, const std::string& body) {
    return post_view(server.port(), body, {{"Content-Encoding", coding}}).status;
  };
  EXPECT_EQ(status("gzip", zipped(view)), 200);
  EXPECT_EQ(status("identity", view), 200);
  EXPECT_EQ(status("gzip", zipped("{")), 400);
  const Answer none = post_view(server.port(), view, {{"Content-Encoding", "gzip"}});
  EXPECT_EQ(none.status, 415);
  EXPECT_EQ(none.header("accept-encoding"), "gzip");
  EXPECT_THAT(json_of(none)["detail"].get<std::string>(), HasSubstr("not gzip"));
  EXPECT_EQ(status("br", view), 415);
  EXPECT_EQ(status("gzip", zipped(std::string(70000, ' '))), 413);
}

}  // namespace
}  // namespace server_test
