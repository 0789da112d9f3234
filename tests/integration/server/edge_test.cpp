// Malformed HTTP requests: each is refused, and the next request is served.
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

class Edge : public testing::Test {
 protected:
  void TearDown() override { EXPECT_EQ(get(port(), "/livez").status, 200); }
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }

  // Refused as a problem, and the connection is closed.
  void expect_refused(std::string_view bytes, int status) const {
    Socket socket(port());
    socket.send(bytes);
    const Answer answer = read_answer(socket);
    EXPECT_EQ(answer.status, status) << answer.body;
    EXPECT_EQ(answer.header("content-type"), "application/problem+json");
    EXPECT_EQ(answer.header("connection"), "close");
    EXPECT_TRUE(socket.closed_by_peer());
  }

  TestServer server_;
};

TEST_F(Edge, AmbiguousRequestsAreRefused) {
  const std::string get = "GET /livez HTTP/1.1\r\n";
  const std::string post = "POST /v1/frames HTTP/1.1\r\nHost: x\r\n";
  struct Case {
    std::string bytes;
    int status;
  };
  for (const Case& c : {
           Case{get + "\r\n", 400},                                 // no Host
           Case{get + "Host: a\r\nHost: b\r\n\r\n", 400},           // two
           Case{get + "Host: a\r\nX: 1\r\n folded\r\n\r\n", 400},   // obs-fold
           Case{get + "Host: a\r\nX: 1\r\n\tfolded\r\n\r\n", 400},  //
           Case{get + "Host: a\nX: 1\r\n\r\n", 400},                // bare LF
           Case{get + "Host : a\r\n\r\n", 400},                     // space before the colon
           Case{get + "Host: a\r\nX\x01: 1\r\n\r\n", 400},          //
           Case{"GET /livez HTTP/2.7\r\nHost: a\r\n\r\n", 505},     //
           Case{"GET livez HTTP/1.1\r\nHost: a\r\n\r\n", 400},      //
           Case{"GET /%zz HTTP/1.1\r\nHost: a\r\n\r\n", 400},       //
           Case{"\x16\x03\x01\x02\r\n\r\n", 400},                   // TLS
           Case{post + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 501},
           Case{post + "Transfer-Encoding: chunked\r\nContent-Length: 2\r\n\r\n{}", 400},
           Case{post + "Transfer-Encoding: identity\r\nContent-Length: 2\r\n\r\n{}", 501},
           Case{post + "Content-Length: 2\r\nContent-Length: 3\r\n\r\n{}", 400},
           Case{post + "Content-Length: -1\r\n\r\n", 400},
           Case{post + "Content-Length: 0x10\r\n\r\n", 400},
           Case{post + "Content-Length: 99999999999999999999999\r\n\r\n", 400},
           Case{post + "\r\n", 411},
           Case{post + "Expect: wonders\r\nContent-Length: 2\r\n\r\n", 417},
       }) {
    SCOPED_TRACE(c.bytes);
    expect_refused(c.bytes, c.status);
  }
}

// DNS rebinding: the page of a foreign name that resolves to this machine.
TEST(LocalHosts, AreTheOnlyHostNamesAnsweredOnLoopback) {
  windsplat::api::ServerOptions options;
  options.local_hosts_only = true;
  options.allow_origins = {"https://winds.example"};
  TestServer server(options);
  const auto status_for = [&](const std::string& host) {
    Socket socket(server.port());
    socket.send("GET /v1/datasets HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n");
    return read_answer(socket).status;
  };
  for (const char* host : {"localhost", "LOCALHOST:8080", "127.0.0.1:1", "127.9.9.9", "[::1]:80",
                           "[::1]", "winds.example"}) {
    EXPECT_EQ(status_for(host), 200) << host;
  }
  for (const char* host : {"evil.example", "evil.example:8080", "127.0.0.1.evil.example",
                           "localhost.evil.example", "[::2]", "winds.example.evil", "10.0.0.1"}) {
    EXPECT_EQ(status_for(host), 421) << host;
  }
}

TEST_F(Edge, OversizeBodyIsRefusedBeforeItIsRead) {
  const std::string post = "POST /v1/frames HTTP/1.1\r\nHost: x\r\n";
  // No body was sent: the response depends on the header only.
  for (const char* length : {"65537", "104857600", "9223372036854775808", "18446744073709551615"}) {
    SCOPED_TRACE(length);
    expect_refused(post + "Content-Length: " + length + "\r\n\r\n", 413);
    expect_refused(post + "Expect: 100-continue\r\nContent-Length: " + length + "\r\n\r\n", 413);
  }
}

TEST_F(Edge, BodyOf100MbSentWithoutWaitingGets413) {
  Socket socket(port());
  socket.send("POST /v1/frames HTTP/1.1\r\nHost: x\r\nContent-Length: 104857600\r\n\r\n");
  const std::string megabyte(1 << 20, 'x');
  for (int n = 0; n < 100; ++n) {
    if (!socket.send(megabyte)) break;  // the server has refused the rest
  }
  EXPECT_EQ(read_answer(socket).status, 413);
}

TEST_F(Edge, HeadersOfEverySizeAroundTheLimit) {
  const std::string start = "GET /livez HTTP/1.1\r\nHost: x\r\nX: ";
  const std::string end = "\r\n\r\n";
  for (const std::size_t size : {8191U, 8192U, 8193U, 9000U, 16383U, 16384U, 16385U, 70000U}) {
    SCOPED_TRACE(size);
    std::string bytes = start;
    bytes.append(size - start.size() - end.size(), 'a');
    bytes += end;
    if (size <= 8192) {
      EXPECT_EQ(raw(port(), bytes).status, 200);
    } else {
      expect_refused(bytes, 431);
    }
  }
  // An endless header.
  Socket socket(port());
  socket.send(start);
  socket.send(std::string(100000, 'a'));
  EXPECT_EQ(read_answer(socket).status, 431);
}

TEST_F(Edge, BodiesAtTheLimitAreRead) {
  for (const std::size_t size : {65535U, 65536U}) {
    const std::string body = R"({"dataset":"small","image":{"width":16,"height":16}})";
    const Answer answer = post_view(port(), body + std::string(size - body.size(), ' '));
    EXPECT_EQ(answer.status, 200) << size << answer.body;
  }
}

TEST_F(Edge, ConnectionCarriesManyRequestsEvenPipelined) {
  Socket socket(port());
  const std::string one = "GET /livez HTTP/1.1\r\nHost: x\r\n\r\n";
  const std::string picture =
      "GET /v1/datasets/small/frame.png?width=20&height=20 HTTP/1.1\r\nHost: x\r\n\r\n";
  socket.send(one + picture + one);
  std::string bytes;
  const auto answers = [&bytes] {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = bytes.find("HTTP/1.1 200 OK", at)) != std::string::npos; ++at) {
      ++count;
    }
    return count;
  };
  while (answers() < 3) {
    const std::string more = socket.receive();
    ASSERT_FALSE(more.empty()) << bytes.size();
    bytes += more;
  }
  EXPECT_LT(bytes.find("PNG"), bytes.rfind("live")) << "in order";
  socket.send(one);
  EXPECT_EQ(read_answer(socket).status, 200);
}

TEST_F(Edge, RefusalAfterAHeadRequestHasItsBody) {
  Socket socket(port());
  socket.send("HEAD /livez HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(read_answer(socket, true).status, 200);
  socket.send("no request\r\n\r\n");
  const Answer answer = read_answer(socket);
  EXPECT_EQ(answer.status, 400);
  EXPECT_EQ(answer.header("content-length"), std::to_string(answer.body.size()));
  EXPECT_FALSE(answer.body.empty());
}

TEST_F(Edge, Http10IsAnsweredAndClosed) {
  Socket socket(port());
  socket.send("GET /livez HTTP/1.0\r\nHost: x\r\n\r\n");
  EXPECT_EQ(read_answer(socket).status, 200);
  EXPECT_TRUE(socket.closed_by_peer());
}

TEST_F(Edge, AbsoluteFormIsTheSamePath) {
  EXPECT_EQ(raw(port(), "GET http://x/livez HTTP/1.1\r\nHost: x\r\n\r\n").status, 200);
}

TEST_F(Edge, ExpectedContinueIsSentBeforeTheBody) {
  const std::string body = R"({"dataset":"small","image":{"width":16,"height":16}})";
  Socket socket(port());
  socket.send(
      "POST /v1/frames HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
      "Expect: 100-continue\r\nContent-Length: " +
      std::to_string(body.size()) + "\r\n\r\n");
  EXPECT_THAT(socket.receive(), testing::StartsWith("HTTP/1.1 100 "));
  socket.send(body);
  EXPECT_EQ(read_answer(socket).status, 200);
}

TEST_F(Edge, SlowHeaderTimesOutWhileOthersAreServed) {
  Socket slow(port());
  slow.send("GET /livez HT");
  Socket silent_body(port());
  silent_body.send("POST /v1/frames HTTP/1.1\r\nHost: x\r\nContent-Length: 10\r\n\r\n{");
  EXPECT_EQ(get(port(), "/livez").status, 200);
  EXPECT_TRUE(slow.closed_by_peer());
  EXPECT_TRUE(silent_body.closed_by_peer());
}

TEST_F(Edge, DisconnectCancelsTheRendering) {
  for (int n = 0; n < 12; ++n) {
    Socket socket(port());
    socket.send(
        "GET /v1/datasets/small/frame.png?width=4096&height=4096 HTTP/1.1\r\n"
        "Host: x\r\n\r\n");
  }
  // If all were rendered, this would take a minute.
  const Answer answer = get(port(), "/v1/datasets/small/frame.jpg?width=32&height=32");
  EXPECT_EQ(answer.status, 200);
}

}  // namespace
}  // namespace server_test
