// Metrics scraped over a socket: format, counters, and that clients cannot create series.
#include <gmock/gmock.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <regex>
#include <thread>

#include "protocol/frame_header.hpp"
#include "tests/integration/server/prometheus_text.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

namespace protocol = windsplat::protocol;

Exposition scrape(std::uint16_t port) {
  const Answer answer = get(port, "/metrics");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.header("content-type"), "text/plain; version=0.0.4; charset=utf-8");
  Exposition read = parse_exposition(answer.body);
  EXPECT_THAT(read.faults, testing::IsEmpty());
  return read;
}

std::string requests(const std::string& route, const std::string& status) {
  return "windsplat_http_requests_total{route=\"" + route + "\",status=\"" + status + "\"}";
}
std::string frames(const std::string& tier) {
  return "windsplat_frames_total{tier=\"" + tier + "\"}";
}

class MetricsTest : public testing::Test {
 protected:
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }

  // Counters updated after the last byte may change a moment later.
  Exposition scrape_until(const std::function<bool(const Exposition&)>& holds) const {
    Exposition read = scrape(port());
    for (int turns = 0; turns < 4000 && !holds(read); ++turns) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      read = scrape(port());
    }
    EXPECT_TRUE(holds(read));
    return read;
  }

  TestServer server_;
};

TEST_F(MetricsTest, PictureIncrementsItsCountersByOne) {
  const Exposition before = scrape(port());
  const Answer picture = get(port(), "/v1/datasets/small/frame.jpg?width=64&height=48");
  ASSERT_EQ(picture.status, 200);
  const std::string write = R"({stage="write"})";
  const Exposition after = scrape_until(
      [&](const Exposition& now) { return now.count("windsplat_stage_seconds", write) > 0; });
  const auto moved = [&](const std::string& sample) {
    return after.value(sample) - before.value(sample);
  };
  EXPECT_EQ(moved(requests("/v1/datasets/{id}/frame", "2xx")), 1);
  EXPECT_EQ(moved(requests("/v1/datasets/{id}/frame", "4xx")), 0);
  for (const std::string stage : {"queue", "render", "encode", "write"}) {
    EXPECT_EQ(moved("windsplat_stage_seconds_count{stage=\"" + stage + "\"}"), 1) << stage;
  }
  // Server-Timing reports the same times, in milliseconds.
  std::smatch render;
  const std::string timing = picture.header("server-timing");
  ASSERT_TRUE(std::regex_search(timing, render, std::regex("render;dur=([0-9.]+)"))) << timing;
  EXPECT_NEAR(moved(R"(windsplat_stage_seconds_sum{stage="render"})"), std::stod(render[1]) / 1000,
              1e-6);
  EXPECT_GE(moved(R"(windsplat_sent_bytes_total{over="http"})"), picture.body.size());
  EXPECT_EQ(moved(frames("final")), 0) << "only frames of sessions count";
}

TEST_F(MetricsTest, LoadsAndHitsAreCountedSeparately) {
  const Exposition before = scrape(port());
  EXPECT_EQ(before.value("windsplat_resident_bytes"), 0);
  EXPECT_EQ(before.value("windsplat_memory_limit_bytes"), 1U << 30);
  ASSERT_EQ(get(port(), "/v1/datasets/small/frame.jpg?width=64&height=48").status, 200);
  const Exposition once = scrape(port());
  EXPECT_EQ(once.value(R"(windsplat_volume_loads_total{result="ok"})"), server_.loads());
  EXPECT_EQ(once.value(R"(windsplat_volume_loads_total{result="failed"})"), 0);
  EXPECT_GT(once.value("windsplat_resident_bytes"), 0);
  ASSERT_EQ(get(port(), "/v1/datasets/small/frame.jpg?width=48&height=64").status, 200);
  const Exposition twice = scrape(port());
  EXPECT_EQ(twice.value(R"(windsplat_volume_loads_total{result="ok"})"),
            once.value(R"(windsplat_volume_loads_total{result="ok"})"));
  EXPECT_GT(twice.value(R"(windsplat_data_lookups_total{result="hit"})"),
            once.value(R"(windsplat_data_lookups_total{result="hit"})"));
}

TEST_F(MetricsTest, FramesOfASessionAreCountedByPurpose) {
  {
    StreamClient viewer(port());
    EXPECT_EQ(scrape_until([](const Exposition& now) {
                return now.value("windsplat_sessions") == 1;
              }).value("windsplat_sessions_opened_total"),
              1);
    viewer.say(R"({"type":"patch","rev":1,"patch":{"dataset":"small",
                  "image":{"width":64,"height":48}}})");
    std::size_t bytes = 0;
    int moving = 0;
    int final = 0;
    while (final == 0) {
      const auto frame = viewer.next_frame();
      ASSERT_TRUE(frame);
      const auto header = protocol::parse_frame_header(
          {reinterpret_cast<const std::uint8_t*>(frame->data()), frame->size()});
      ASSERT_TRUE(header);
      bytes += frame->size();
      ((header->flags & protocol::flag_final) != 0 ? final : moving) += 1;
      viewer.say(R"({"type":"ack","seq":)" + std::to_string(header->seq) + R"(,"decodeMs":1})");
    }
    viewer.say(R"({"type":"still","id":9,"width":100,"height":50,"format":"png","scale":1})");
    const auto still = viewer.next_frame();
    ASSERT_TRUE(still);
    for (const std::string& text : viewer.texts) bytes += text.size();
    const Exposition now =
        scrape_until([](const Exposition& read) { return read.value(frames("still")) == 1; });
    EXPECT_EQ(now.value(frames("final")), 1);
    EXPECT_EQ(now.value(frames("moving")) + now.value(frames("rest")), moving);
    EXPECT_GE(now.value(R"(windsplat_sent_bytes_total{over="stream"})"), bytes + still->size());
    EXPECT_EQ(now.value(requests("/v1/stream", "1xx")), 1);
  }
  const Exposition gone =
      scrape_until([](const Exposition& now) { return now.value("windsplat_sessions") == 0; });
  EXPECT_EQ(gone.value("windsplat_sessions_opened_total"), 1);
}

// One frame waits for such peers at any time, and a second one after they read; the rest are kernel
// buffers of a few hundred kilobytes.
TEST_F(MetricsTest, PeersThatNeverReadHoldOneFrameEach) {
  constexpr int peers = 5;  // a frame each before the first is given up as too slow
  const std::string image = R"("image":{"width":2000,"height":1500})";
  const Answer picture = request(port(), "POST", "/v1/frames",
                                 {{"Content-Type", "application/json"}, {"Accept", "image/png"}},
                                 R"({"dataset":"small",)" + image + "}");
  ASSERT_EQ(picture.status, 200);
  ASSERT_GT(picture.body.size(), 3U << 18) << "more than a socket buffer holds";
  std::vector<std::unique_ptr<StreamClient>> deaf;
  for (int i = 0; i < peers; ++i) {
    deaf.push_back(std::make_unique<StreamClient>(port(), Headers{}, "/v1/stream", 131072));
    deaf.back()->say(R"({"type":"patch","rev":1,"patch":{"dataset":"small"}})");
    for (int still = 1; still <= 4; ++still) {
      deaf.back()->say(R"({"type":"still","id":)" + std::to_string(still) +
                       R"(,"width":2000,"height":1500,"format":"png","scale":1})");
    }
  }
  const double frame = static_cast<double>(picture.body.size());
  scrape_until([&](const Exposition& now) {
    return now.value("windsplat_unsent_bytes") > peers * 0.5 * frame;
  });
  // Unless refused, all requests were rendered meanwhile.
  ASSERT_EQ(get(port(), "/v1/datasets/small/frame.jpg?width=64&height=48").status, 200);
  EXPECT_LE(scrape(port()).value("windsplat_unsent_bytes"), peers * (1.2 * frame + 65536));
  deaf.clear();
  scrape_until([](const Exposition& now) { return now.value("windsplat_unsent_bytes") == 0; });
}

TEST_F(MetricsTest, ClientsCannotCreateSeries) {
  const Exposition before = scrape(port());
  for (int i = 0; i < 50; ++i) {
    const std::string name = "nothing-" + std::to_string(i);
    EXPECT_EQ(get(port(), '/' + name).status, 404);
    EXPECT_EQ(get(port(), "/v1/datasets/" + name).status, 404);
    EXPECT_EQ(get(port(), "/v1/jobs/" + name).status, 404);
  }
  EXPECT_EQ(request(port(), "DELETE", "/v1").status, 405);
  EXPECT_EQ(request(port(), "BREW", "/v1").status, 501);
  EXPECT_EQ(raw(port(), "\x16\x03\x01\x02\r\n\r\n").status, 400);
  std::vector<std::unique_ptr<StreamClient>> viewers;
  for (int i = 0; i < 20; ++i) viewers.push_back(std::make_unique<StreamClient>(port()));
  const Exposition after =
      scrape_until([](const Exposition& now) { return now.value("windsplat_sessions") == 20; });
  const auto names = [](const Exposition& read) {
    std::set<std::string> out;
    for (const auto& [name, value] : read.samples) out.insert(name);
    return out;
  };
  EXPECT_EQ(names(after), names(before));
  EXPECT_EQ(after.value(requests("other", "4xx")), 51);
  EXPECT_EQ(after.value(requests("/v1/datasets/{id}", "4xx")), 50);
  EXPECT_EQ(after.value(requests("/v1", "4xx")), 1);
}

TEST_F(MetricsTest, AreServedWhileTheRendererIsBusy) {
  Socket waiting(port());
  waiting.send(
      "GET /v1/datasets/small/frame.png?width=4096&height=4096 HTTP/1.1\r\nHost: x\r\n\r\n");
  // The first frame starts when the data are resident.
  scrape_until([](const Exposition& now) { return now.value("windsplat_resident_bytes") > 0; });
  for (int i = 0; i < 5; ++i) scrape(port());
  EXPECT_EQ(waiting.receive(1), "") << "the picture is not ready";
}

TEST_F(MetricsTest, OfTheProcessMatchTheSystem) {
  const Exposition now = scrape(port());
  EXPECT_GT(now.value("process_resident_memory_bytes"), 1 << 20);
  EXPECT_GT(now.value("process_cpu_seconds_total"), 0);
  const double open = now.value("process_open_fds");
  Socket one(port());
  Socket two(port());
  // Both ends of each connection are in this process.
  const Exposition later = scrape_until(
      [&](const Exposition& read) { return read.value("process_open_fds") >= open + 4; });
  EXPECT_LE(later.value("process_open_fds"), open + 6);
  EXPECT_EQ(later.value(std::string("windsplat_build_info{version=\"") + WINDSPLAT_VERSION + "\"}"),
            1);
}

TEST(MetricsAt, RootAndBasePath) {
  windsplat::api::ServerOptions options;
  options.base_path = "/winds";
  TestServer server(options);
  EXPECT_EQ(get(server.port(), "/winds/metrics").status, 200);
  EXPECT_EQ(get(server.port(), "/metrics").status, 200);
  EXPECT_EQ(get(server.port(), "/metrics?name=x").status, 400);
  EXPECT_EQ(request(server.port(), "POST", "/metrics", {}, "{}").status, 405);
}

TEST_F(MetricsTest, AreExactlyThoseOfTheManual) {
  std::ifstream manual(WINDSPLAT_SOURCE_DIR "/docs/user/metrics.md");
  std::map<std::string, std::string> types;
  const std::regex row(R"(^\| `([a-z_]+)` \| (counter|gauge|histogram) \|.*)");
  for (std::string line; std::getline(manual, line);) {
    std::smatch found;
    if (!std::regex_match(line, found, row)) continue;
    types[found[1]] = found[2];
  }
  EXPECT_EQ(types, scrape(port()).types);
}

}  // namespace
}  // namespace server_test
