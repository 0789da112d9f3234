// The stream end to end over a real socket: views in, frames out, and refusals.
#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "protocol/frame_header.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

namespace protocol = windsplat::protocol;
using testing::HasSubstr;

struct Frame {
  protocol::FrameHeader header;
  std::string payload;
  [[nodiscard]] bool is_final() const { return (header.flags & protocol::flag_final) != 0; }
};

std::optional<Frame> parse_frame(const std::optional<std::string>& bytes) {
  if (!bytes) return std::nullopt;
  const auto header = protocol::parse_frame_header(
      {reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()});
  EXPECT_TRUE(header) << header.error().message;
  if (!header) return std::nullopt;
  return Frame{*header, bytes->substr(protocol::frame_header_bytes)};
}

// A session that acknowledges every frame.
class Viewer : public StreamClient {
 public:
  using StreamClient::StreamClient;

  void patch(std::uint32_t rev, const std::string& json) {
    say(R"({"type":"patch","rev":)" + std::to_string(rev) + R"(,"t":)" + std::to_string(rev) +
        R"(.5,"patch":)" + json + "}");
  }
  void ack(std::uint32_t seq) {
    say(R"({"type":"ack","seq":)" + std::to_string(seq) + R"(,"decodeMs":1})");
  }
  std::optional<Frame> frame(int timeout_ms = patience_ms) {
    auto out = parse_frame(next_frame(timeout_ms));
    if (out) ack(out->header.seq);
    return out;
  }
  std::optional<Frame> final_frame(std::uint32_t rev) {
    while (auto out = frame()) {
      if (out->is_final() && out->header.rev == rev) return out;
    }
    return std::nullopt;
  }
};

const char* const small_view = R"({"dataset":"small","image":{"width":160,"height":120}})";

class Stream : public testing::Test {
 protected:
  void TearDown() override {
    Viewer good(port());
    good.patch(1, small_view);
    EXPECT_TRUE(good.final_frame(1)) << "the next viewer is served";
  }
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  TestServer server_;
};

TEST_F(Stream, SendsHelloFirstAndNegotiatesTheProtocol) {
  StreamClient offers(port(), {{"Sec-WebSocket-Protocol", "chat, windsplat.v1"}});
  EXPECT_EQ(offers.handshake().status, 101);
  EXPECT_EQ(offers.handshake().header("sec-websocket-protocol"), "windsplat.v1");
  const auto first = offers.next();
  ASSERT_TRUE(first);
  const Json hello = Json::parse(first->data);
  EXPECT_EQ(hello["type"], "hello");
  EXPECT_EQ(hello["protocol"], "windsplat.v1");
  EXPECT_EQ(hello["datasets"][0]["id"], "small");
  StreamClient plain(port());
  EXPECT_EQ(plain.handshake().status, 101);
  EXPECT_EQ(plain.handshake().header("sec-websocket-protocol"), "");
  EXPECT_TRUE(plain.next_text("hello"));
}

TEST_F(Stream, OpenAndPatchGiveAMovingAndAFinalFrame) {
  Viewer viewer(port());
  viewer.say(R"({"type":"open","id":3,"dataset":"small"})");
  const auto opened = viewer.next_text("opened");
  ASSERT_TRUE(opened);
  EXPECT_EQ(Json::parse(*opened)["id"], 3);
  EXPECT_EQ(Json::parse(*opened)["dataset"]["dims"]["x"], 32);
  viewer.patch(8, R"({"image":{"width":160,"height":120},"step":2})");
  const auto final = viewer.final_frame(8);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->header.step, 2U);
  EXPECT_EQ(final->header.t, 8.5);
  EXPECT_EQ(final->header.level, 0);
  EXPECT_EQ(final->header.payload_bytes, final->payload.size());
  const Picture picture = decode_jpeg(final->payload);
  EXPECT_EQ(picture.width, 160);
  EXPECT_EQ(picture.height, 120);
  EXPECT_GT(picture.distinct(), 160U * 120U / 50);
}

TEST_F(Stream, PatchAndAcksSuffice) {
  Viewer viewer(port());
  viewer.patch(1, small_view);
  const auto moving = viewer.frame();
  ASSERT_TRUE(moving);
  EXPECT_EQ(moving->header.seq, 1U);
  EXPECT_FALSE(moving->is_final());
  const Picture picture = decode_jpeg(moving->payload);
  EXPECT_EQ(picture.width, moving->header.width);
  EXPECT_EQ(picture.height, moving->header.height);
  EXPECT_LE(picture.width, 160 >> moving->header.level);
  EXPECT_GT(picture.width, 160 >> (moving->header.level + 1));
  const auto final = viewer.final_frame(1);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->header.seq, 2U);
  // Each was announced by a `chosen` message.
  std::vector<int> announced;
  for (const std::string& text : viewer.texts) {
    const Json json = Json::parse(text);
    if (json["type"] == "chosen") announced.push_back(json["seq"]);
  }
  EXPECT_THAT(announced, testing::ElementsAre(1, 2));
}

TEST_F(Stream, ChosenReportsAViewThatRendersTheSamePicture) {
  Viewer viewer(port());
  viewer.patch(1, small_view);
  ASSERT_TRUE(viewer.final_frame(1));
  Json chosen;
  for (const std::string& text : viewer.texts) {
    const Json json = Json::parse(text);
    if (json["type"] == "chosen") chosen = json;
  }
  EXPECT_GT(chosen["work"]["samples"], 0);
  const std::string told = chosen["view"].dump();
  EXPECT_EQ(post_view(port(), told, {{"Accept", "image/png"}}).body,
            post_view(port(), small_view, {{"Accept", "image/png"}}).body);
}

TEST_F(Stream, NoThirdFrameBeforeAnAck) {
  Viewer viewer(port());
  viewer.patch(1, small_view);
  ASSERT_TRUE(viewer.next_frame());
  viewer.patch(2, R"({"step":1})");
  ASSERT_TRUE(viewer.next_frame());
  for (std::uint32_t rev = 3; rev < 30; ++rev) {
    viewer.patch(rev, R"({"step":)" + std::to_string(rev % small_steps) + "}");
  }
  // The error reply proves that all of them were received.
  viewer.say(R"({"type":"nonsense"})");
  ASSERT_TRUE(viewer.next_text("error"));
  EXPECT_FALSE(viewer.next_frame(400)) << "the credit is two frames";
  viewer.ack(2);
  const auto third = parse_frame(viewer.next_frame());
  ASSERT_TRUE(third);
  EXPECT_EQ(third->header.seq, 3U);
  EXPECT_EQ(third->header.rev, 29U) << "the newest view";
}

TEST_F(Stream, DragShowsMovingFramesAndEndsWithTheFinalFrame) {
  Viewer viewer(port());
  viewer.patch(1, small_view);
  ASSERT_TRUE(viewer.final_frame(1));
  std::uint32_t rev = 1;
  std::size_t moved = 0;
  std::uint32_t last = 1;
  for (int n = 0; n < 60; ++n) {
    viewer.patch(++rev, R"({"camera":{"eye":[)" + std::to_string(n * 0.02) + ",-3,1.5]}}");
    if (auto frame = viewer.frame(30)) {
      EXPECT_FALSE(frame->is_final());
      EXPECT_GE(frame->header.rev, last);
      last = frame->header.rev;
      ++moved;
    }
  }
  EXPECT_GE(moved, 5U) << "the picture follows the input";
  EXPECT_TRUE(viewer.final_frame(rev));
}

TEST_F(Stream, StillFollowsItsAnnouncementAtItsSize) {
  Viewer viewer(port());
  viewer.patch(1, small_view);
  ASSERT_TRUE(viewer.final_frame(1));
  viewer.say(R"({"type":"still","id":9,"width":100,"height":50,"format":"png","scale":2})");
  const auto still = viewer.frame();
  ASSERT_TRUE(still);
  EXPECT_EQ(still->header.codec, protocol::Codec::png);
  EXPECT_EQ(still->header.width, 200);
  EXPECT_EQ(still->header.height, 100);
  EXPECT_THAT(still->payload, testing::StartsWith("\x89PNG"));
  const auto chosen = Json::parse(viewer.texts.back());
  EXPECT_EQ(chosen["type"], "chosen");
  EXPECT_EQ(chosen["seq"], still->header.seq);
  const auto progress = Json::parse(viewer.texts[viewer.texts.size() - 2]);
  EXPECT_EQ(progress["type"], "progress");
  EXPECT_EQ(progress["id"], 9);
  EXPECT_EQ(progress["done"], 1);
}

TEST_F(Stream, LosslessViewEndsWithThePngOfARequest) {
  Viewer viewer(port());
  const char* const view =
      R"({"dataset":"small","image":{"width":160,"height":120},"quality":{"lossless":true}})";
  viewer.patch(1, view);
  const auto moving = viewer.frame();
  ASSERT_TRUE(moving);
  EXPECT_EQ(moving->header.codec, protocol::Codec::jpeg);
  const auto final = viewer.final_frame(1);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->header.codec, protocol::Codec::png);
  EXPECT_EQ(final->header.quality, 100);
  EXPECT_EQ(final->payload, post_view(port(), view, {{"Accept", "image/png"}}).body);
}

TEST_F(Stream, PlayShowsTheSteps) {
  Viewer viewer(port());
  viewer.patch(1, small_view);
  ASSERT_TRUE(viewer.final_frame(1));
  viewer.say(R"({"type":"play","from":0,"to":2,"fps":20,"loop":true,"drop":false})");
  std::vector<std::uint32_t> steps;
  while (steps.size() < 6) {
    const auto frame = viewer.frame();
    ASSERT_TRUE(frame);
    steps.push_back(frame->header.step);
  }
  EXPECT_THAT(steps, testing::ElementsAre(1U, 2U, 0U, 1U, 2U, 0U));
  viewer.say(R"({"type":"pause"})");
  while (auto frame = viewer.frame()) {
    if (frame->is_final()) break;
  }
}

TEST_F(Stream, TwoSessionsShareLoadedDataAndKeepTheirViews) {
  Viewer one(port());
  Viewer two(port());
  one.patch(1, R"({"dataset":"small","image":{"width":64,"height":48}})");
  two.patch(5, R"({"dataset":"small","image":{"width":96,"height":40}})");
  const auto first = one.final_frame(1);
  const auto second = two.final_frame(5);
  ASSERT_TRUE(first);
  ASSERT_TRUE(second);
  EXPECT_EQ(first->header.width, 64);
  EXPECT_EQ(second->header.width, 96);
  // Two fields of this step, and of the next one, which is prefetched some time after the frames.
  constexpr std::uint64_t loads = 4;
  EXPECT_TRUE(comes_true([&] { return server_.loads() == loads; })) << server_.loads();
  Viewer three(port());
  three.patch(1, small_view);
  ASSERT_TRUE(three.final_frame(1));
  EXPECT_EQ(server_.loads(), loads) << "each volume was read once";
}

// --- invalid input ------------------------------------------------------------------------------

TEST_F(Stream, InvalidMessagesAreAnsweredAndTheConnectionStays) {
  Viewer viewer(port());
  viewer.patch(1, small_view);
  ASSERT_TRUE(viewer.final_frame(1));
  struct Case {
    const char* text;
    int status;
    const char* holds;  // in the answer
  };
  for (const Case& c : {
           Case{"{", 400, ""},
           Case{"[]", 422, ""},
           Case{R"({"type":"dance"})", 422, "/type"},
           Case{R"({"type":"patch","rev":7,"patch":{"colour":1}})", 422, R"("rev":7)"},
           Case{R"({"type":"patch","rev":8,"patch":{"step":99}})", 422, "/step"},
           Case{R"({"type":"patch","rev":8,"patch":{"camera":{"fovY":NaN}}})", 400, ""},
           Case{R"({"type":"patch","rev":8,"patch":{"image":{"width":1000000000}}})", 422,
                "/image/width"},
           Case{R"({"type":"open","id":4,"dataset":"nowhere"})", 404, R"("id":4)"},
           Case{R"({"type":"ack","seq":1000})", 422, "/seq"},
           Case{R"({"type":"play","from":0,"to":99})", 422, "/to"},
       }) {
    SCOPED_TRACE(c.text);
    viewer.say(c.text);
    const auto error = viewer.next_text("error");
    ASSERT_TRUE(error);
    EXPECT_EQ(Json::parse(*error)["problem"]["status"], c.status) << *error;
    EXPECT_THAT(*error, HasSubstr(c.holds));
  }
  viewer.patch(9, R"({"step":1})");
  const auto frame = viewer.final_frame(9);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->header.step, 1U);
}

TEST_F(Stream, ProtocolViolationsCloseWithTheirCode) {
  {
    StreamClient client(port());
    client.send_frame(Opcode::binary, "only the server sends frames");
    EXPECT_EQ(client.close_code(), 4400);
  }
  {
    StreamClient client(port());
    client.send_frame(Opcode::text, "\xff\xff");
    EXPECT_EQ(client.close_code(), 1007);
  }
  {
    StreamClient client(port());
    client.send_frame(Opcode::text, std::string(65537, ' '));
    EXPECT_EQ(client.close_code(), 1009);
  }
  {
    // Empty fragments: none is too large, but the message never ends.
    StreamClient client(port());
    client.send_frame(Opcode::text, "", false);
    for (int n = 0; n < 60000; ++n) {
      if (!client.send_frame(Opcode::more, "", false)) break;
    }
    EXPECT_EQ(client.close_code(), 1009);
  }
  {
    StreamClient client(port());
    client.socket.send(std::string("\xc1\x80\x01\x02\x03\x04", 6));  // reserved bit: compressed
    EXPECT_EQ(client.close_code(), 1002);
  }
}

// A ping between fragments does not end the message.
TEST_F(Stream, EndlessMessageTimesOutDespitePings) {
  StreamClient client(port());
  ASSERT_TRUE(client.next_text("hello"));
  client.send_frame(Opcode::text, "", false);
  bool cut = false;
  // A message may take 10 s; this one would take three times as long.
  for (int n = 0; n < 60 && !cut; ++n) {
    client.send_frame(Opcode::ping, "x");
    client.send_frame(Opcode::more, "", false);
    cut = client.socket.closed_by_peer(500);
  }
  EXPECT_TRUE(cut);
}

TEST_F(Stream, PingsDoNotCountAsMessages) {
  StreamClient client(port());
  for (int n = 0; n < 24; ++n) {
    client.send_frame(Opcode::ping, "x");
    EXPECT_FALSE(client.socket.closed_by_peer(500)) << n;
  }
}

TEST_F(Stream, PeerThatClosedIsNotWaitedFor) {
  StreamClient client(port());
  ASSERT_TRUE(client.next_text("hello"));
  const auto begin = std::chrono::steady_clock::now();
  // Sent at once: the server finds the close after it has begun its own.
  const std::string mask(4, '\0');
  client.socket.send("\x82\x81" + mask + "x" + "\x88\x82" + mask + "\x03\xe8");
  EXPECT_EQ(client.close_code(), 4400);
  EXPECT_TRUE(client.socket.closed_by_peer());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(1500))
      << "the server waits 2 s for a silent client";
}

TEST_F(Stream, MessageAtTheLimitIsRead) {
  Viewer viewer(port());
  const std::string patch = R"({"type":"patch","rev":1,"patch":)" + std::string(small_view) + "}";
  viewer.say(patch + std::string(65536 - patch.size(), ' '));
  EXPECT_TRUE(viewer.final_frame(1));
}

TEST_F(Stream, PagesOfOtherOriginsCannotConnect) {
  const std::string own = "http://127.0.0.1:" + std::to_string(port());
  const auto status = [&](const std::string& origin) {
    return StreamClient(port(), {{"Origin", origin}}).handshake().status;
  };
  EXPECT_EQ(status(own), 101);
  EXPECT_EQ(status("http://127.0.0.1:1"), 403);
  EXPECT_EQ(status("http://evil.example"), 403);
  EXPECT_EQ(status("http://evil.example?127.0.0.1:" + std::to_string(port())), 403);
  EXPECT_EQ(status("null"), 403);
  windsplat::api::ServerOptions options;
  options.allow_origins = {"https://lab.example"};
  const TestServer other(options);
  EXPECT_EQ(StreamClient(other.port(), {{"Origin", "https://lab.example"}}).handshake().status,
            101);
  EXPECT_EQ(StreamClient(other.port(), {{"Origin", "http://lab.example"}}).handshake().status, 403);
}

TEST_F(Stream, SessionsAboveTheLimitAreRefusedWithTheReason) {
  windsplat::api::ServerOptions options;
  options.sessions_max = 2;
  TestServer server(options);
  {
    StreamClient one(server.port());
    StreamClient two(server.port());
    ASSERT_TRUE(one.next_text("hello"));
    ASSERT_TRUE(two.next_text("hello"));
    StreamClient three(server.port());
    EXPECT_EQ(three.close_code(), 1013);
  }
  // Their slots are free after they disconnect.
  for (int turns = 0; turns < 100; ++turns) {
    StreamClient next(server.port());
    if (next.next_text("hello")) return;
  }
  FAIL() << "no slot was released";
}

TEST_F(Stream, SilenceClosesTheSession) {
  windsplat::api::ServerOptions options;
  options.idle_timeout_s = 1;
  const TestServer server(options);
  StreamClient client(server.port());
  EXPECT_EQ(client.close_code(), 4410);
}

TEST_F(Stream, PeerThatNeverReadsIsSentAtMostTwoFrames) {
  StreamClient deaf(port(), {}, "/v1/stream", 4096);
  deaf.say(R"({"type":"patch","rev":1,"patch":{"dataset":"small",
              "image":{"width":1600,"height":1200}}})");
  Viewer viewer(port());
  viewer.patch(1, small_view);
  for (std::uint32_t rev = 2; rev < 40; ++rev) {
    deaf.say(R"({"type":"patch","rev":)" + std::to_string(rev) + R"(,"patch":{"step":)" +
             std::to_string(rev % small_steps) + "}}");
  }
  ASSERT_TRUE(viewer.final_frame(1)) << "others are served meanwhile";
  // Now the client reads: two frames are in flight, and no more come without an ack.
  int frames = 0;
  while (deaf.next_frame(3000)) ++frames;
  EXPECT_GE(frames, 1);
  EXPECT_LE(frames, 2);
}

}  // namespace
}  // namespace server_test
