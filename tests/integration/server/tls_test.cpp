// The server with TLS: requests, streams, deadlines, and certificates replaced while it runs.
#include "server/transport/tls.hpp"

#include <gmock/gmock.h>

#include <chrono>

#include "tests/integration/certificate.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;
using windsplat::api::ServerOptions;
using windsplat::transport::Access;
using Clock = std::chrono::steady_clock;

std::shared_ptr<windsplat::transport::TlsContext> tls_named(const std::string& name) {
  const Certificate made = make_certificate(name);
  auto tls = windsplat::transport::make_tls(made.chain, made.key);
  EXPECT_TRUE(tls) << (tls ? "" : tls.error().message);
  return tls ? *tls : nullptr;
}

ServerOptions in_tls() {
  ServerOptions options;
  options.tls = tls_named("first");
  return options;
}

class Tls : public testing::Test {
 protected:
  void TearDown() override { EXPECT_EQ(get(place(), "/livez").status, 200); }
  [[nodiscard]] Place place() const { return {server_.port(), true}; }
  [[nodiscard]] std::uint16_t plain() const { return server_.port(); }

  TestServer server_{in_tls()};
};

TEST_F(Tls, RequestsAreAnsweredWithStrictTransportSecurity) {
  EXPECT_THAT(server_.server().url(), testing::StartsWith("https://127.0.0.1:"));
  const Answer live = get(place(), "/livez");
  EXPECT_EQ(live.status, 200);
  EXPECT_EQ(live.header("strict-transport-security"), "") << "loopback is shared with other users";
  Socket by_name(place());
  by_name.send("GET /livez HTTP/1.1\r\nHost: winds.example\r\n\r\n");
  EXPECT_EQ(read_answer(by_name).header("strict-transport-security"), "max-age=15552000");
  const Answer picture = get(place(), "/v1/datasets/small/frame.jpg?width=300&height=200");
  EXPECT_EQ(picture.status, 200);
  EXPECT_EQ(decode_jpeg(picture.body).width, 300);
  const Answer view = post_view(place(), R"({"dataset":"small","image":{"width":20,"height":20}})");
  EXPECT_EQ(view.status, 200) << view.body;
  TestServer without;
  Socket plain_by_name(without.port());
  plain_by_name.send("GET /livez HTTP/1.1\r\nHost: winds.example\r\n\r\n");
  EXPECT_EQ(read_answer(plain_by_name).header("strict-transport-security"), "");
}

TEST_F(Tls, SupportsTls13AndHttp11) {
  Socket socket(place());
  ASSERT_TRUE(socket.shaken());
  EXPECT_EQ(socket.version(), "TLSv1.3");
  EXPECT_EQ(socket.protocol(), "http/1.1");
  EXPECT_EQ(socket.peer_name(), "first");
}

TEST_F(Tls, ConnectionCarriesManyRequestsEvenPipelined) {
  Socket socket(place());
  const std::string ask =
      "GET /v1/datasets/small/frame.png?width=20&height=20 HTTP/1.1\r\nHost: x\r\n\r\n";
  for (int n = 0; n < 3; ++n) {
    socket.send(ask);
    EXPECT_EQ(read_answer(socket).status, 200);
  }
  socket.send(ask + ask);
  std::string bytes;
  for (int answers = 0; answers < 2;) {
    const std::string more = socket.receive();
    ASSERT_FALSE(more.empty());
    bytes += more;
    answers = 0;
    for (std::size_t at = 0; (at = bytes.find("HTTP/1.1 200", at)) != std::string::npos; ++at) {
      ++answers;
    }
  }
  socket.say_goodbye();
  EXPECT_TRUE(socket.closed_by_peer());
}

// Frames of every size arrive complete: small ones share a record, large ones take many.
TEST_F(Tls, StreamSendsFrames) {
  StreamClient viewer(place(), {{"Sec-WebSocket-Protocol", "windsplat.v1"}});
  ASSERT_EQ(viewer.handshake().status, 101);
  ASSERT_TRUE(viewer.next_text("hello"));
  viewer.say(R"({"type":"open","id":1,"dataset":"small"})");
  ASSERT_TRUE(viewer.next_text("opened"));
  std::size_t largest = 0;
  for (int rev = 1; rev <= 3; ++rev) {
    const int edge = 40 << (2 * rev);
    viewer.say(R"({"type":"patch","rev":)" + std::to_string(rev) +
               R"(,"t":0,"patch":{"image":{"width":)" + std::to_string(edge) + R"(,"height":)" +
               std::to_string(edge) + "}}}");
    bool whole = false;
    while (!whole) {
      const auto frame = viewer.next_frame();
      ASSERT_TRUE(frame);
      ASSERT_EQ(frame->substr(0, 4), "WSPL");
      EXPECT_GT(decode_jpeg(frame->substr(64)).width, 0);
      largest = std::max(largest, frame->size());
      viewer.say(R"({"type":"ack","seq":)" +
                 std::to_string(static_cast<unsigned char>((*frame)[8])) + R"(,"decodeMs":1})");
      whole = ((*frame)[20] & 1) != 0 && (*frame)[12] == rev;
    }
  }
  EXPECT_GT(largest, std::size_t{3} * 16384) << "more than one record holds";
  viewer.send_frame(Opcode::close, "\x03\xe8");
  EXPECT_EQ(viewer.close_code(), 1000);
  EXPECT_TRUE(viewer.socket.closed_by_peer());
}

TEST_F(Tls, PlainHttpClientGetsAnExplanation) {
  const Answer answer = raw(plain(), "GET /livez HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(answer.status, 400);
  EXPECT_THAT(answer.body, HasSubstr("https://"));
  EXPECT_EQ(answer.header("connection"), "close");
}

TEST_F(Tls, NoiseIsDisconnected) {
  for (const std::string& noise : {std::string(100, '\0'), std::string(70000, '\xff'),
                                   std::string("\x16\x03\x01\x40\x00", 5)}) {
    Socket socket(plain());
    socket.send(noise);
    EXPECT_TRUE(socket.closed_by_peer(20'000)) << "no later than the handshake deadline";
  }
}

TEST_F(Tls, HandshakeHasADeadlineWhileOthersAreServed) {
  Socket silent(plain());
  Socket slow(plain());
  slow.send(std::string("\x16\x03\x01\x02", 4));
  const auto begin = Clock::now();
  EXPECT_EQ(get(place(), "/livez").status, 200);
  EXPECT_TRUE(silent.closed_by_peer(20'000));
  EXPECT_TRUE(slow.closed_by_peer(20'000));
  EXPECT_GT(Clock::now() - begin, std::chrono::seconds(3)) << "not refused at once";
}

TEST_F(Tls, SlowHeaderTimesOut) {
  Socket slow(place());
  slow.send("GET /livez HT");
  EXPECT_TRUE(slow.closed_by_peer(20'000));
}

// With and without close_notify; if all were rendered, the last would take a minute.
TEST_F(Tls, DisconnectCancelsTheRendering) {
  for (int n = 0; n < 12; ++n) {
    Socket socket(place());
    socket.send(
        "GET /v1/datasets/small/frame.png?width=4096&height=4096 HTTP/1.1\r\nHost: x\r\n\r\n");
    if (n % 2 == 0) socket.say_goodbye();
  }
  EXPECT_EQ(get(place(), "/v1/datasets/small/frame.jpg?width=32&height=32").status, 200);
  const std::string metrics = get(place(), "/metrics").body;
  const std::string left =
      "windsplat_http_requests_total{route=\"/v1/datasets/{id}/frame\",status=\"4xx\"} ";
  const std::size_t at = metrics.find(left);
  ASSERT_NE(at, std::string::npos);
  EXPECT_GE(std::stoi(metrics.substr(at + left.size())), 6) << "those with close_notify";
}

// TLS records are not always a request or a close.
TEST_F(Tls, KeyUpdateDuringAPictureIsNoDisconnect) {
  Socket socket(place());
  socket.send(
      "GET /v1/datasets/small/frame.png?width=1500&height=1500 HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_TRUE(socket.change_key());
  EXPECT_EQ(read_answer(socket).status, 200);
  socket.send("GET /livez HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(read_answer(socket).status, 200);
}

TEST_F(Tls, KeyUpdateDuringAStreamIsNoDisconnect) {
  StreamClient viewer(place());
  ASSERT_TRUE(viewer.next_text("hello"));
  EXPECT_TRUE(viewer.socket.change_key());
  // Longer than a message may take from its first byte.
  EXPECT_FALSE(viewer.next(12'000));
  viewer.say(R"({"type":"open","id":1,"dataset":"small"})");
  EXPECT_TRUE(viewer.next_text("opened"));
}

// A client that sends a refused body still gets its response.
TEST_F(Tls, OversizeBodyGets413) {
  Socket socket(place());
  socket.send("POST /v1/frames HTTP/1.1\r\nHost: x\r\nContent-Length: 104857600\r\n\r\n");
  const std::string megabyte(1 << 20, 'x');
  for (int n = 0; n < 100; ++n) {
    if (!socket.send(megabyte)) break;
  }
  EXPECT_EQ(read_answer(socket).status, 413);
}

// The write deadline is 15 s plus a time for the size.
TEST_F(Tls, SessionThatNeverReadsIsClosed) {
  StreamClient viewer(place(), {}, "/v1/stream", 4096);
  ASSERT_TRUE(viewer.next_text("hello"));
  viewer.say(R"({"type":"open","id":1,"dataset":"small"})");
  ASSERT_TRUE(viewer.next_text("opened"));
  for (int rev = 1; rev <= 40; ++rev) {
    viewer.say(
        R"({"type":"patch","rev":)" + std::to_string(rev) +
        R"(,"t":0,"patch":{"image":{"width":2000,"height":2000},"quality":{"lossless":true},)" +
        R"("camera":{"roll":)" + std::to_string(rev) + "}}}");
  }
  for (int turns = 0; turns < 300; ++turns) {
    if (get(place(), "/metrics").body.find("windsplat_sessions 0") != std::string::npos) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  FAIL() << "it still holds its session";
}

TEST_F(Tls, NewCertificateIsUsedForNewConnections) {
  Socket old(place());
  StreamClient viewer(place());
  ASSERT_TRUE(viewer.next_text("hello"));
  server_.server().change(Access{{}, nullptr, tls_named("second"), false, {}});
  for (int turns = 0; turns < 1000 && Socket(place()).peer_name() != "second"; ++turns) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(Socket(place()).peer_name(), "second");
  EXPECT_EQ(old.peer_name(), "first");
  old.send("GET /livez HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(read_answer(old).status, 200);
  viewer.say(R"({"type":"open","id":1,"dataset":"small"})");
  EXPECT_TRUE(viewer.next_text("opened"));
}

TEST(TlsDrain, SendsCloseNotify) {
  TestServer server(in_tls());
  StreamClient viewer(Place(server.port(), true));
  ASSERT_TRUE(viewer.next_text("hello"));
  server.server().drain();
  EXPECT_EQ(viewer.close_code(), 1001);
  EXPECT_TRUE(viewer.socket.closed_by_peer());
}

TEST(TlsFiles, InvalidFilesAreRefusedWithAReason) {
  const Certificate mine = make_certificate("mine");
  const Certificate other = make_certificate("other");
  const auto refused = [](const std::string& chain, const std::string& key) {
    const auto tls = windsplat::transport::make_tls(chain, key);
    EXPECT_FALSE(tls);
    return tls ? "" : tls.error().message;
  };
  EXPECT_THAT(refused("", mine.key), HasSubstr("certificate"));
  EXPECT_THAT(refused("no PEM", mine.key), HasSubstr("certificate"));
  EXPECT_THAT(refused(mine.key, mine.chain), HasSubstr("swapped"));
  EXPECT_THAT(refused(mine.chain, ""), HasSubstr("key"));
  EXPECT_THAT(refused(mine.chain, mine.chain), HasSubstr("key"));
  EXPECT_THAT(refused(mine.chain, other.key), HasSubstr("key"));
  EXPECT_THAT(refused(mine.chain, mine.key.substr(0, mine.key.size() / 2)), HasSubstr("key"));
  EXPECT_TRUE(windsplat::transport::make_tls(mine.chain, mine.key));
}

}  // namespace
}  // namespace server_test
