// Restart of a daemon with open sessions: the client's complete view restores its state.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "protocol/frame_header.hpp"
#include "tests/integration/cli_program.hpp"
#include "tests/integration/client.hpp"

namespace cli_test {
namespace {

using Json = nlohmann::json;
namespace protocol = windsplat::protocol;

struct Frame {
  protocol::FrameHeader header;
  std::string payload;
};

class Viewer : public server_test::StreamClient {
 public:
  using StreamClient::StreamClient;

  void patch(std::uint32_t rev, const Json& patch) {
    say(Json{{"type", "patch"}, {"rev", rev}, {"t", 10.5 * rev}, {"patch", patch}}.dump());
  }
  // The final frame of that rev; the seq of every frame is added to `seqs`.
  std::optional<Frame> final_frame(std::uint32_t rev) {
    while (const auto bytes = next_frame()) {
      const auto header = protocol::parse_frame_header(
          {reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()});
      if (!header) return std::nullopt;
      seqs.push_back(header->seq);
      say(Json{{"type", "ack"}, {"seq", header->seq}, {"decodeMs", 1}}.dump());
      if ((header->flags & protocol::flag_final) == 0 || header->rev != rev) continue;
      return Frame{*header, bytes->substr(protocol::frame_header_bytes)};
    }
    return std::nullopt;
  }

  std::vector<std::uint32_t> seqs;
};

// Changes of a user in order.
const std::vector<Json>& deeds() {
  static const std::vector<Json> all{
      Json::parse(R"({"dataset":"climate-small","image":{"width":160,"height":120}})"),
      Json::parse(R"({"camera":{"eye":[0.9,-2.1,1.4],"target":[0,0,0.1],"fovY":40}})"),
      Json::parse(R"({"step":1})"),
      Json::parse(R"({"scalars":[{"field":"cloud","extinction":[[0,0],[0.3,2],[1,9]],
                                  "color":{"map":"plasma"}}]})"),
      Json::parse(R"({"vector":{"color":{"map":"viridis"},"length":0.2}})"),
      Json::parse(R"({"camera":{"eye":[1.2,-1.9,1.4]},"image":{"background":"#102030"}})"),
      Json::parse(R"({"method":{"name":"slab","slabThickness":2}})"),
  };
  return all;
}

TEST(Resume, ViewSentToARestartedDaemonGivesTheSamePicture) {
  const Folder folder;
  const std::string dataset = synth(folder, "climate", "24x16x6");
  Json whole = Json::object();
  std::string picture;
  std::string port;
  {
    Process daemon({"serve", dataset, "--listen", "127.0.0.1:0"});
    const std::uint16_t number = port_of(daemon);
    port = std::to_string(number);
    Viewer viewer(number);
    std::uint32_t rev = 0;
    for (const Json& deed : deeds()) {
      whole.merge_patch(deed);
      viewer.patch(++rev, deed);
      const auto frame = viewer.final_frame(rev);
      ASSERT_TRUE(frame) << deed << (viewer.texts.empty() ? "" : viewer.texts.back());
      EXPECT_NE(frame->payload, picture) << deed << " shows";
      picture = frame->payload;
    }
    daemon.send(SIGTERM);
    EXPECT_EQ(viewer.close_code(), 1001);
    EXPECT_EQ(daemon.wait(), 0);
  }
  Process daemon({"serve", dataset, "--listen", "127.0.0.1:" + port});
  ASSERT_EQ(std::to_string(port_of(daemon)), port);
  Viewer viewer(static_cast<std::uint16_t>(std::stoi(port)));
  viewer.patch(41, whole);
  const auto frame = viewer.final_frame(41);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->payload, picture);
  EXPECT_EQ(frame->header.step, 1U);
  EXPECT_EQ(frame->header.t, 10.5 * 41);
  EXPECT_EQ(viewer.seqs.front(), 1U) << "a new session starts a new count";
  EXPECT_EQ(viewer.seqs.back(), viewer.seqs.size());
}

}  // namespace
}  // namespace cli_test
