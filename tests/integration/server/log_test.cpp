// Request ids in responses and in the log, and data that must not be logged.
#include "server/base/log.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <sstream>
#include <thread>

#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

namespace log = windsplat::log;
using testing::HasSubstr;
using testing::MatchesRegex;
using testing::Not;

// The complete log of a server, which has stopped before its lines are read.
class Logged : public testing::Test {
 protected:
  void SetUp() override {
    log::configure(log::Format::json, log::Level::debug);
    testing::internal::CaptureStderr();
  }
  void TearDown() override {
    if (capturing_) (void)lines();
    log::configure(log::Format::text, log::Level::info);
  }
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }

  std::vector<Json> lines() {
    server_.stop();
    capturing_ = false;
    text_ = testing::internal::GetCapturedStderr();
    std::istringstream in(text_);
    std::vector<Json> out;
    for (std::string line; std::getline(in, line);) {
      out.push_back(Json::parse(line, nullptr, false));
      EXPECT_TRUE(out.back().is_object()) << line;
    }
    return out;
  }
  std::vector<Json> lines_of(const std::string& request_id) {
    std::vector<Json> out;
    for (Json& line : lines()) {
      if (line.value("request", "") == request_id) out.push_back(std::move(line));
    }
    return out;
  }

  std::string text_;
  bool capturing_ = true;
  TestServer server_;
};

TEST_F(Logged, RequestIdIsReturnedAndLogged) {
  const std::string id = "Az09._-" + std::string(57, 'x');
  const Answer answer = get(port(), "/v1/datasets/small/frame.jpg?width=40&height=30&preset=wind",
                            {{"X-Request-Id", id}});
  EXPECT_EQ(answer.header("x-request-id"), id);
  const auto told = lines_of(id);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0]["message"], "request");
  EXPECT_EQ(told[0]["level"], "info");
  EXPECT_EQ(told[0]["method"], "GET");
  EXPECT_EQ(told[0]["route"], "/v1/datasets/{id}/frame");
  EXPECT_EQ(told[0]["status"], answer.status);
  EXPECT_GT(told[0]["bytes"].get<std::size_t>(), answer.body.size());
  EXPECT_GE(told[0]["ms"].get<double>(), 0);
}

TEST_F(Logged, InvalidRequestIdIsReplaced) {
  std::set<std::string> ids;
  const std::string too_long(65, 'x');
  for (const char* given : {"two words", "a,b", "", "\"quoted\"", "\xc3\xa4", too_long.c_str()}) {
    const Answer answer = get(port(), "/livez", {{"X-Request-Id", given}});
    const std::string id = answer.header("x-request-id");
    EXPECT_THAT(id, MatchesRegex("[0-9a-f]{16}")) << given;
    ids.insert(id);
  }
  ids.insert(
      get(port(), "/livez", {{"X-Request-Id", "a"}, {"X-Request-Id", "b"}}).header("x-request-id"));
  EXPECT_EQ(ids.size(), 7U) << "each has its own";
}

TEST_F(Logged, ProblemsContainTheirRequestId) {
  const Answer own = get(port(), "/v1/datasets/none", {{"X-Request-Id", "mine-1"}});
  EXPECT_EQ(own.status, 404);
  EXPECT_EQ(json_of(own)["requestId"], "mine-1");
  EXPECT_EQ(json_of(own)["status"], 404);
  // Also for malformed requests.
  const Answer refused = raw(port(), "GET / HTTP/1.1\nHost: x\r\n\r\n");
  EXPECT_EQ(refused.status, 400);
  const std::string id = refused.header("x-request-id");
  EXPECT_THAT(id, MatchesRegex("[0-9a-f]{16}"));
  EXPECT_EQ(json_of(refused)["requestId"], id);
  const auto told = lines_of(id);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0]["route"], "other");
  EXPECT_EQ(told[0]["status"], 400);
}

TEST_F(Logged, RequestsOfOneConnectionHaveDistinctIds) {
  Socket socket(port());
  const std::string request = "GET /v1 HTTP/1.1\r\nHost: x\r\n";
  socket.send(request + "X-Request-Id: first\r\n\r\n");
  EXPECT_EQ(read_answer(socket).header("x-request-id"), "first");
  socket.send(request + "\r\n");
  EXPECT_THAT(read_answer(socket).header("x-request-id"), MatchesRegex("[0-9a-f]{16}"));
}

TEST_F(Logged, SessionHasTheRequestIdOfItsUpgrade) {
  {
    StreamClient viewer(port(), {{"X-Request-Id", "viewer-7"}});
    EXPECT_EQ(viewer.handshake().status, 101);
    EXPECT_EQ(viewer.handshake().header("x-request-id"), "viewer-7");
    ASSERT_TRUE(viewer.next_text("hello"));
  }
  for (int turns = 0; turns < 1000; ++turns) {
    if (get(port(), "/metrics").body.find("windsplat_sessions 0") != std::string::npos) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  std::vector<std::string> messages;
  for (const Json& line : lines_of("viewer-7")) messages.push_back(line["message"]);
  EXPECT_THAT(messages, testing::ElementsAre("session opened", "session disconnected"));
}

TEST_F(Logged, ContainsNoPathsQueriesOrHeaders) {
  get(port(), "/v1/datasets/small/frame.jpg?width=40&height=30&token=hunter2",
      {{"Authorization", "Bearer hunter2"}, {"Cookie", "session=hunter2"}});
  get(port(), "/hunter2?hunter2", {{"Referer", "https://hunter2.example/"}});
  request(port(), "POST", "/v1/frames", {{"Content-Type", "application/json"}},
          R"({"dataset":"hunter2"})");
  request(port(), "GET", "/v1/datasets/hunter2");
  EXPECT_EQ(StreamClient(port(), {}, "/v1/stream?token=hunter2").handshake().status, 400);
  StreamClient viewer(port(), {{"Sec-WebSocket-Protocol", "windsplat.v1, bearer.hunter2"}},
                      "/v1/stream?page=hunter2");
  EXPECT_EQ(viewer.handshake().status, 101);
  const std::size_t told = lines().size();
  EXPECT_GE(told, 5U);
  EXPECT_THAT(text_, Not(HasSubstr("hunter2")));
}

}  // namespace
}  // namespace server_test
