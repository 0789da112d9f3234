// Video over a real socket: announced, chosen on a slow link, decoded by OpenH264's own decoder and
// compared with the picture of the same view by HTTP.
#ifdef WINDSPLAT_OPENH264

#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "protocol/frame_header.hpp"
#include "tests/integration/server/prometheus_text.hpp"
#include "tests/integration/server/test_server.hpp"
#include "tests/unit/image/decoded_video.hpp"

namespace server_test {
namespace {

namespace protocol = windsplat::protocol;
using protocol::Codec;

struct VideoFrame {
  protocol::FrameHeader header;
  std::vector<std::uint8_t> unit;
  [[nodiscard]] bool is_key() const { return (header.flags & protocol::flag_key) != 0; }
  [[nodiscard]] bool is_final() const { return (header.flags & protocol::flag_final) != 0; }
};

std::string camera_of(int n) {
  const double angle = 0.03 * n;
  return R"("camera":{"eye":[)" + std::to_string(2.4 * std::sin(angle)) + "," +
         std::to_string(-2.4 * std::cos(angle)) + ",1.6]}";
}

// Reads no faster than a link of 60 kB/s would carry the frames.
class SlowClient : public StreamClient {
 public:
  using StreamClient::StreamClient;

  void announce(const char* codecs = R"(["avc1.640033"])") {
    say(std::string(R"({"type":"video","codecs":)") + codecs + "}");
  }
  void patch(const std::string& keys) {
    ++rev;
    say(R"({"type":"patch","rev":)" + std::to_string(rev) + R"(,"patch":{)" + keys + "}}");
  }
  std::optional<VideoFrame> frame() {
    const auto bytes = next_frame();
    if (!bytes) return std::nullopt;
    const std::span<const std::uint8_t> all{reinterpret_cast<const std::uint8_t*>(bytes->data()),
                                            bytes->size()};
    const auto header = protocol::parse_frame_header(all);
    EXPECT_TRUE(header);
    if (!header) return std::nullopt;
    constexpr double bytes_per_ms = 60;
    const auto on_link = static_cast<int>(static_cast<double>(all.size()) / bytes_per_ms);
    std::this_thread::sleep_for(std::chrono::milliseconds(on_link));
    say(R"({"type":"ack","seq":)" + std::to_string(header->seq) + "}");
    const auto unit = all.subspan(protocol::frame_header_bytes);
    return VideoFrame{*header, {unit.begin(), unit.end()}};
  }
  // Frames of a drag, each of a newer view, until `count` of that codec were received; at most 200.
  std::vector<VideoFrame> drag(Codec codec, int count) {
    std::vector<VideoFrame> out;
    for (int n = 0; n < 200 && count > 0; ++n) {
      patch(camera_of(static_cast<int>(rev)));
      auto next = frame();
      if (!next) return out;
      if (next->header.codec == codec) --count;
      out.push_back(std::move(*next));
    }
    EXPECT_EQ(count, 0) << "frames of that codec are missing";
    return out;
  }
  void open(int width, int height) {
    patch(R"("dataset":"small","image":{"width":)" + std::to_string(width) + R"(,"height":)" +
          std::to_string(height) + "}");
  }

  std::uint32_t rev = 0;
};

double metric(std::uint16_t port, const std::string& name) {
  return parse_exposition(get(port, "/metrics").body).value(name);
}

// Luma (ITU-R BT.601, full range) of a picture.
std::vector<std::uint8_t> luma_of(const Picture& picture) {
  std::vector<std::uint8_t> out;
  for (std::size_t n = 0; n + 2 < picture.rgb.size(); n += 3) {
    const double value =
        0.299 * picture.rgb[n] + 0.587 * picture.rgb[n + 1] + 0.114 * picture.rgb[n + 2];
    out.push_back(static_cast<std::uint8_t>(std::lround(value)));
  }
  return out;
}

// PSNR in dB between a decoded frame and the view of that rev drawn by HTTP at the frame's size.
double likeness(std::uint16_t port, const decoded_video::Luma& decoded, const VideoFrame& frame,
                std::uint32_t rev) {
  const std::string view = R"({"dataset":"small","image":{"width":)" +
                           std::to_string(frame.header.width) + R"(,"height":)" +
                           std::to_string(frame.header.height) + "}," +
                           camera_of(static_cast<int>(rev) - 1) + "}";
  const Answer answer = post_view(port, view, {{"Accept", "image/jpeg"}});
  EXPECT_EQ(answer.status, 200) << answer.body;
  const Picture picture = decode_jpeg(answer.body);
  const auto luma = luma_of(picture);
  return decoded_video::psnr(decoded, luma.data(), picture.width, picture.width, picture.height);
}

TEST(VideoStream, EveryFrameOfASlowLinkIsDecodedAndShowsItsView) {
  const TestServer server;
  SlowClient client(server.port());
  client.announce();
  client.open(321, 239);
  const auto frames = client.drag(Codec::h264, 12);
  decoded_video::Decoder decoder;
  int videos = 0;
  int width = 0;
  for (const VideoFrame& frame : frames) {
    if (frame.header.codec != Codec::h264) continue;
    EXPECT_EQ(frame.header.payload_bytes, frame.unit.size());
    EXPECT_FALSE(frame.is_final());
    EXPECT_EQ(frame.is_key(), videos == 0 || frame.header.width != width) << "frame " << videos;
    width = frame.header.width;
    const auto decoded = decoder.decode(frame.unit);
    ASSERT_TRUE(decoded) << "frame " << videos;
    EXPECT_EQ(decoded->width, width + width % 2);
    if (++videos != 12) continue;
    const double own = likeness(server.port(), *decoded, frame, frame.header.rev);
    EXPECT_GT(own, 15);  // coastlines take many bits of a slow link, and a busy machine has fewer
    EXPECT_GT(own, likeness(server.port(), *decoded, frame, frame.header.rev + 20) + 3)
        << "the picture of another view is less alike";
  }
  EXPECT_EQ(metric(server.port(), "windsplat_video_encoders"), 1);
  EXPECT_GE(metric(server.port(), R"(windsplat_video_frames_total{picture="key"})"), 1);
  EXPECT_EQ(metric(server.port(), "windsplat_video_failures_total"), 0);
  while (const auto last = client.frame()) {
    if (!last->is_final()) continue;
    EXPECT_EQ(last->header.codec, Codec::jpeg);
    EXPECT_EQ(decode_jpeg({last->unit.begin(), last->unit.end()}).width, 321);
    break;
  }
}

TEST(VideoStream, IsNotSentToAClientThatAnnouncesNothing) {
  const TestServer server;
  SlowClient client(server.port());
  client.open(320, 240);
  for (const VideoFrame& frame : client.drag(Codec::jpeg, 20)) {
    EXPECT_EQ(frame.header.codec, Codec::jpeg);
  }
  EXPECT_EQ(metric(server.port(), "windsplat_video_encoders"), 0);
}

TEST(VideoStream, AnnouncingAgainGivesAKeyFrameForANewDecoder) {
  const TestServer server;
  SlowClient client(server.port());
  client.announce();
  client.open(320, 240);
  ASSERT_FALSE(client.drag(Codec::h264, 4).empty());
  client.announce();
  decoded_video::Decoder fresh;
  bool begun = false;
  int decoded = 0;
  for (const VideoFrame& frame : client.drag(Codec::h264, 6)) {
    begun = begun || frame.is_key();
    if (!begun || frame.header.codec != Codec::h264) continue;
    EXPECT_TRUE(fresh.decode(frame.unit));
    ++decoded;
  }
  EXPECT_GE(decoded, 4) << "at most the frames in flight precede the key frame";
  client.announce("[]");
  const auto after = client.drag(Codec::jpeg, 4);
  EXPECT_EQ(after.back().header.codec, Codec::jpeg);
  EXPECT_EQ(metric(server.port(), "windsplat_video_encoders"), 0);
}

TEST(VideoStream, TheEncoderIsFreedWithItsSession) {
  const TestServer server;
  {
    SlowClient client(server.port());
    client.announce();
    client.open(320, 240);
    ASSERT_FALSE(client.drag(Codec::h264, 2).empty());
    EXPECT_EQ(metric(server.port(), "windsplat_video_encoders"), 1);
  }
  double left = 1;
  for (int n = 0; n < 600 && left > 0; ++n) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    left = metric(server.port(), "windsplat_video_encoders");
  }
  EXPECT_EQ(left, 0);
}

}  // namespace
}  // namespace server_test

#endif
