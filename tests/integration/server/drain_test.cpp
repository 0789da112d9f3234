// Orderly shutdown: readiness fails first, streams are closed, pictures in progress are answered.
#include <gmock/gmock.h>

#include <chrono>
#include <thread>
#include <vector>

#include "protocol/frame_header.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

// Receives and acknowledges frames until the view is at rest, so that the next request starts at
// once.
bool until_final(StreamClient& client) {
  while (const auto bytes = client.next_frame()) {
    const auto header = windsplat::protocol::parse_frame_header(
        {reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()});
    if (!header) return false;
    client.say(Json{{"type", "ack"}, {"seq", header->seq}, {"decodeMs", 1}}.dump());
    if ((header->flags & windsplat::protocol::flag_final) != 0) return true;
  }
  return false;
}

TEST(Drain, IdleServerStops) {
  TestServer server;
  EXPECT_EQ(get(server.port(), "/livez").status, 200);
  server.stop();
  EXPECT_EQ(get(server.port(), "/livez").status, 0) << "the listening socket is closed";
}

TEST(Drain, RepeatedOrEarlyDrainIsHarmless) {
  TestServer server;
  server.server().drain();
  server.server().drain();
  server.stop();
}

TEST(Drain, StreamsAreClosedWith1001) {
  TestServer server;
  StreamClient idle(server.port());
  ASSERT_TRUE(idle.next_text("hello"));
  StreamClient busy(server.port());
  busy.say(R"({"type":"patch","rev":1,"patch":{"dataset":"small",
              "image":{"width":4096,"height":4096}}})");
  ASSERT_TRUE(busy.next_text("hello"));
  server.server().drain();
  EXPECT_EQ(idle.close_code(), 1001);
  EXPECT_EQ(busy.close_code(), 1001);
  server.stop();
}

TEST(Drain, IsNotDelayedByRepeatedRequests) {
  TestServer server;
  std::vector<std::thread> clients;
  clients.reserve(6);
  for (int n = 0; n < 6; ++n) {
    clients.emplace_back([port = server.port()] {
      while (get(port, "/v1/datasets/small/frame.jpg?width=16&height=16").status != 0) {
      }
    });
  }
  ASSERT_EQ(get(server.port(), "/livez").status, 200);
  const auto begin = std::chrono::steady_clock::now();
  server.stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(7))
      << "connections are ended after 8 s; nothing here takes that long";
  for (std::thread& client : clients) client.join();
}

// Operations still in progress at the deadline must not access destroyed objects.
TEST(Drain, RemainingConnectionsAreClosedAtTheDeadline) {
  windsplat::api::ServerOptions options;
  options.drain_cancel_after = std::chrono::milliseconds(0);
  options.drain_abort_after = std::chrono::milliseconds(0);
  TestServer server(options);
  StreamClient idle(server.port());
  ASSERT_TRUE(idle.next_text("hello"));
  StreamClient busy(server.port());
  busy.say(R"({"type":"patch","rev":1,"patch":{"dataset":"small",
              "image":{"width":2000,"height":2000}}})");
  ASSERT_TRUE(busy.next_text("hello"));
  Socket drawing(server.port());
  drawing.send(
      "GET /v1/datasets/small/frame.png?width=2000&height=2000 HTTP/1.1\r\n"
      "Host: x\r\n\r\n");
  Socket silent(server.port());
  server.stop();
  EXPECT_TRUE(idle.socket.closed_by_peer());
  EXPECT_TRUE(busy.socket.closed_by_peer());
  EXPECT_TRUE(silent.closed_by_peer());
  EXPECT_TRUE(drawing.closed_by_peer());
}

TEST(Drain, RunningPictureIsAnsweredWhileReadinessFails) {
  windsplat::api::ServerOptions options;
  options.drain_cancel_after = std::chrono::minutes(1);  // a slow build needs more than the default
  options.drain_abort_after = std::chrono::minutes(2);
  TestServer server(options);
  Socket drawing(server.port());
  drawing.send(
      "GET /v1/datasets/small/frame.png?width=600&height=600 HTTP/1.1\r\n"
      "Host: x\r\n\r\n");
  // A stream that does not answer its close delays the end of the drain for a moment.
  StreamClient stream(server.port());
  ASSERT_TRUE(stream.next_text("hello"));
  server.server().drain();
  const auto closing = stream.next();
  ASSERT_TRUE(closing);
  const Answer ready = get(server.port(), "/readyz");
  if (ready.status != 0) {  // otherwise it had already ended
    EXPECT_EQ(ready.status, 503);
    EXPECT_EQ(get(server.port(), "/v1").status, 503);
  }
  const Answer answer = read_answer(drawing);
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.header("connection"), "close");
  server.stop();
}

TEST(Drain, PeerThatNeverReadsDoesNotDelayIt) {
  TestServer server;
  // A picture of noise too large for kernel buffers: its write is blocked when the drain starts.
  StreamClient deaf(server.port(), {}, "/v1/stream", 4096);
  deaf.say(R"({"type":"patch","rev":1,"patch":{"dataset":"small",
              "image":{"width":32,"height":32}}})");
  ASSERT_TRUE(until_final(deaf));
  deaf.say(R"({"type":"still","id":1,"width":3000,"height":3000,"format":"png"})");
  const auto progress = [&deaf] { return Json::parse(deaf.texts.back()); };
  do ASSERT_TRUE(deaf.next_text("progress"));
  while (progress()["done"] != 1);
  server.stop();
  while (deaf.next(1000)) {
  }
  EXPECT_TRUE(deaf.socket.closed_by_peer());
}

TEST(Drain, IdleConnectionsDoNotDelayIt) {
  TestServer server;
  Socket silent(server.port());
  Socket between(server.port());
  between.send("GET /livez HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(read_answer(between).status, 200);
  server.server().drain();
  EXPECT_TRUE(silent.closed_by_peer());
  EXPECT_TRUE(between.closed_by_peer());
  server.stop();
}

}  // namespace
}  // namespace server_test
