// Clients that misuse video over real sockets: encoders and memory stay bounded, and others get
// their frames.
#ifdef WINDSPLAT_OPENH264

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "protocol/frame_header.hpp"
#include "protocol/limits.hpp"
#include "server/image/video_streams.hpp"
#include "tests/integration/server/prometheus_text.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test::video_floods {
namespace {

namespace protocol = windsplat::protocol;
using protocol::Codec;
constexpr int streams_max = windsplat::image::VideoStreams::streams_max;

double metric(std::uint16_t port, const std::string& name) {
  return parse_exposition(get(port, "/metrics").body).value(name);
}

// Announces H.264 and tells a slow link by late acknowledgements.
class Misuser : public StreamClient {
 public:
  explicit Misuser(std::uint16_t port, int width = 320, int height = 240) : StreamClient(port) {
    say(R"({"type":"video","codecs":["avc1.640033"]})");
    patch(R"("dataset":"small",)" + size(width, height));
  }
  static std::string size(int width, int height) {
    return R"("image":{"width":)" + std::to_string(width) + R"(,"height":)" +
           std::to_string(height) + "}";
  }
  void patch(const std::string& keys) {
    say(R"({"type":"patch","rev":)" + std::to_string(++rev) + R"(,"patch":{)" + keys + "}}");
  }
  void turn() {
    const double angle = 0.03 * rev;
    patch(R"("camera":{"eye":[)" + std::to_string(2.4 * std::sin(angle)) + "," +
          std::to_string(-2.4 * std::cos(angle)) + ",1.6]}");
  }
  // The next frame, not acknowledged.
  std::optional<protocol::FrameHeader> receive(int timeout_ms = patience_ms) {
    const auto bytes = next_frame(timeout_ms);
    if (!bytes) return std::nullopt;
    const auto header = protocol::parse_frame_header(
        {reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()});
    EXPECT_TRUE(header);
    return header ? std::optional(*header) : std::nullopt;
  }
  void acknowledge(const protocol::FrameHeader& header) {
    say(R"({"type":"ack","seq":)" + std::to_string(header.seq) + "}");
  }
  // Acknowledged as late as on a link of 60 kB/s.
  std::optional<protocol::FrameHeader> frame() {
    auto header = receive();
    if (!header) return std::nullopt;
    constexpr std::uint32_t bytes_per_ms = 60;
    std::this_thread::sleep_for(std::chrono::milliseconds(header->payload_bytes / bytes_per_ms));
    acknowledge(*header);
    return header;
  }
  // Turns until a frame of H.264 arrived, at most 100 times.
  bool begin_video() {
    for (int n = 0; n < 100; ++n) {
      turn();
      const auto header = frame();
      if (!header) return false;
      if (header->codec == Codec::h264) return true;
    }
    return false;
  }

  std::uint32_t rev = 0;
};

// Another client gets the final frame of a view.
void expect_served(std::uint16_t port) {
  const Answer answer = post_view(port, R"({"dataset":"small","image":{"width":64,"height":48}})",
                                  {{"Accept", "image/jpeg"}});
  EXPECT_EQ(answer.status, 200) << answer.body;
}

TEST(VideoFloods, ClientThatNeverAcknowledgesGetsTwoFramesAndOthersTheirs) {
  const TestServer server;
  Misuser deaf(server.port());
  ASSERT_TRUE(deaf.begin_video());
  deaf.turn();
  int unacknowledged = 0;
  for (int n = 0; n < 40; ++n) {
    deaf.turn();
    if (deaf.receive(50)) ++unacknowledged;
  }
  EXPECT_GE(unacknowledged, 1);
  EXPECT_LE(unacknowledged, 2) << "the credit";
  Misuser other(server.port());
  EXPECT_TRUE(other.begin_video());
  EXPECT_EQ(metric(server.port(), "windsplat_video_encoders"), 2);
}

TEST(VideoFloods, ClientsThatDisconnectAmidTheirFramesLeaveNoEncoder) {
  const TestServer server;
  for (int n = 0; n < 8; ++n) {
    Misuser brief(server.port(), 640, 480);
    ASSERT_TRUE(brief.begin_video()) << n;
    for (int turns = 0; turns < 5; ++turns) brief.turn();  // a frame is drawn or on its way
  }
  EXPECT_TRUE(comes_true([&] { return metric(server.port(), "windsplat_video_encoders") == 0; }));
  EXPECT_EQ(metric(server.port(), "windsplat_video_failures_total"), 0);
  expect_served(server.port());
}

TEST(VideoFloods, ASizeForEachFrameGivesAKeyFrameForEachAndOneEncoder) {
  const TestServer server;
  Misuser restless(server.port());
  ASSERT_TRUE(restless.begin_video());
  int videos = 0;
  std::pair<int, int> before{0, 0};
  for (int n = 0; n < 40; ++n) {
    // One after the other from very wide to very high, also odd and less than the encoder can.
    restless.patch(Misuser::size(15 + 9 * n, 15 + 7 * (39 - n)));
    restless.turn();
    const auto header = restless.frame();
    ASSERT_TRUE(header) << n;
    if (header->codec != Codec::h264) continue;
    const std::pair<int, int> size{header->width, header->height};
    EXPECT_GE(std::min(size.first, size.second), 16);
    // The first frame may still have the size that video began with.
    if (videos > 0 && size != before) {
      EXPECT_TRUE((header->flags & protocol::flag_key) != 0) << n;
    }
    before = size;
    ++videos;
  }
  EXPECT_GT(videos, 0);
  EXPECT_LE(metric(server.port(), "windsplat_video_encoders"), 1);
  EXPECT_EQ(metric(server.port(), "windsplat_video_failures_total"), 0);
  expect_served(server.port());
}

TEST(VideoFloods, AbsurdCodecsAreRefusedOrGiveJpeg) {
  const TestServer server;
  Misuser client(server.port());
  const auto announce = [&](const std::string& codecs) {
    client.say(R"({"type":"video","codecs":)" + codecs + "}");
  };
  std::string many = "[";
  for (std::size_t n = 0; n <= protocol::limits::video_codecs_max; ++n) {
    many += n == 0 ? R"("avc1.640033")" : R"(,"avc1.640033")";
  }
  announce("[]");
  const auto is_error = [](const std::string& text) {
    return Json::parse(text).value("type", "") == "error";
  };
  for (const std::string& refused :
       {many + "]", std::string("[7]"), std::string("[[]]"), std::string("{}"),
        std::string(R"([""])"), std::string("null")}) {
    announce(refused);
    EXPECT_TRUE(client.next_text("error")) << refused;
  }
  // Names that may be refused leave no announcement behind.
  announce(R"(["avc1.64\u0000033"])");
  announce("[\"" + std::string(4000, 'x') + "\"]");
  client.turn();
  ASSERT_TRUE(client.frame());
  const auto errors_before = std::count_if(client.texts.begin(), client.texts.end(), is_error);
  announce(R"(["avc1.64ffff00","avc1.64-001","avc1.640009","AVC1.640033","avc1.42e01f","avc1"])");
  for (int n = 0; n < 15; ++n) {
    client.turn();
    const auto header = client.frame();
    ASSERT_TRUE(header);
    EXPECT_EQ(header->codec, Codec::jpeg);
  }
  EXPECT_EQ(std::count_if(client.texts.begin(), client.texts.end(), is_error), errors_before)
      << "names that are not understood are passed over";
  EXPECT_EQ(metric(server.port(), "windsplat_video_encoders"), 0);
}

// More clients than encoders: the others get JPEG, and all get frames.
TEST(VideoFloods, ManyClientsShareTheEncodersAndAllGetFrames) {
  windsplat::api::ServerOptions options;
  options.limits.sessions_per_address = 100;
  options.sessions_max = 100;
  const TestServer server(options);
  constexpr int count = 64;
  std::vector<std::unique_ptr<Misuser>> clients;
  for (int n = 0; n < count; ++n)
    clients.push_back(std::make_unique<Misuser>(server.port(), 64, 48));
  std::vector<int> videos(count, 0);
  std::vector<int> frames(count, 0);
  double most = 0;
  for (int turn = 0; turn < 12; ++turn) {
    for (const auto& client : clients) client->turn();
    std::vector<protocol::FrameHeader> received;
    for (int n = 0; n < count; ++n) {
      const auto header = clients[n]->receive();
      ASSERT_TRUE(header) << n;
      received.push_back(*header);
      ++frames[n];
      if (header->codec == Codec::h264) ++videos[n];
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // of a slow link
    for (int n = 0; n < count; ++n) clients[n]->acknowledge(received[n]);
    most = std::max(most, metric(server.port(), "windsplat_video_encoders"));
  }
  EXPECT_THAT(frames, testing::Each(12));
  EXPECT_LE(most, streams_max);
  EXPECT_GE(count - std::count(videos.begin(), videos.end(), 0), streams_max);
  clients.clear();
  EXPECT_TRUE(comes_true([&] { return metric(server.port(), "windsplat_video_encoders") == 0; }));
}

}  // namespace
}  // namespace server_test::video_floods

#endif
