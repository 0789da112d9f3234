// Limits over real sockets: excess is refused with the limit and a retry time, health requests are
// still served, and resources are released.
#include <gmock/gmock.h>

#include <chrono>
#include <memory>
#include <thread>

#include "server/data/files/files.hpp"
#include "server/data/open/open.hpp"
#include "tests/integration/server/prometheus_text.hpp"
#include "tests/integration/server/slow_source.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;
using windsplat::api::ServerOptions;

// Refused with the reason.
void expect_limit(const Answer& answer, int status, const std::string& words) {
  EXPECT_EQ(answer.status, status) << answer.body;
  EXPECT_EQ(answer.header("content-type"), "application/problem+json");
  EXPECT_THAT(json_of(answer).value("detail", ""), HasSubstr(words));
  EXPECT_GE(std::atoi(answer.header("retry-after").c_str()), 1);
}

// The client reads only the head of an upgrade response.
void expect_no_upgrade(const StreamClient& viewer, int status) {
  EXPECT_EQ(viewer.handshake().status, status);
  EXPECT_GE(std::atoi(viewer.handshake().header("retry-after").c_str()), 1);
}

double refused(std::uint16_t port, const std::string& limit) {
  const Exposition read = parse_exposition(get(port, "/metrics").body);
  return read.value("windsplat_refused_total{limit=\"" + limit + "\"}");
}

// Connections that have been accepted; `busy`: with the start of a request sent.
std::vector<std::unique_ptr<Socket>> hold(std::uint16_t port, int count, bool busy = true) {
  std::vector<std::unique_ptr<Socket>> held;
  for (int n = 0; n < count; ++n) {
    held.push_back(std::make_unique<Socket>(port));
    held.back()->send("GET /livez HTTP/1.1\r\nHost: x\r\n\r\n");
    EXPECT_EQ(read_answer(*held.back()).status, 200);
    if (busy) held.back()->send("GET ");
  }
  if (busy) std::this_thread::sleep_for(std::chrono::milliseconds(200));  // time for it to arrive
  return held;
}

TEST(Limits, AtTheConnectionLimitOnlyHealthIsAnswered) {
  ServerOptions options;
  options.limits.connections = 3;
  TestServer server(options);
  auto held = hold(server.port(), 3);
  for (const char* path : {"/livez", "/readyz", "/metrics"}) {
    const Answer answer = get(server.port(), path);
    EXPECT_EQ(answer.status, 200) << path;
    EXPECT_EQ(answer.header("connection"), "close");
  }
  expect_limit(get(server.port(), "/v1"), 503, "3 connections");
  StreamClient viewer(server.port());
  EXPECT_EQ(viewer.handshake().status, 503);
  EXPECT_GE(refused(server.port(), "connections"), 2);
  held.clear();
  EXPECT_TRUE(comes_true([&] { return get(server.port(), "/v1").status == 200; }));
}

TEST(Limits, LongestIdleConnectionIsClosedForANewOne) {
  ServerOptions options;
  options.limits.connections = 2;
  TestServer server(options);
  const auto held = hold(server.port(), 2, false);
  EXPECT_EQ(get(server.port(), "/v1").status, 200);
  EXPECT_TRUE(held[0]->closed_by_peer());
  held[1]->send("GET /v1 HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(read_answer(*held[1]).status, 200);
}

TEST(Limits, SilentConnectionIsClosedSoon) {
  TestServer server;
  Socket silent(server.port());
  const auto kept = hold(server.port(), 1, false);
  // 5 s; six times that on a machine that runs many tests at once, half the timeout of an idle
  // connection.
  EXPECT_TRUE(silent.closed_by_peer(30'000));
  kept[0]->send("GET /livez HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(read_answer(*kept[0]).status, 200) << "the timeout between requests is longer";
}

TEST(Limits, ConnectionsAboveTheirRateAreClosed) {
  ServerOptions options;
  options.limits.arrivals_per_address = 0.5;  // burst of 5
  TestServer server(options);
  const auto answered = [&] { return get(server.port(), "/livez").status == 200; };
  int taken = 0;
  while (answered() && taken < 50) ++taken;
  EXPECT_GE(taken, 4);  // one may have been used to wait for the server
  EXPECT_LT(taken, 20) << "the test itself takes time";
  EXPECT_TRUE(comes_true(answered));
}

// Malformed requests are counted too.
TEST(Limits, MalformedInputIsChargedLikeRequests) {
  ServerOptions options;
  options.limits.requests_per_address = 1;  // burst of 10
  TestServer server(options);
  for (int n = 0; n < 20; ++n) EXPECT_EQ(raw(server.port(), "nonsense\r\n\r\n").status, 400) << n;
  expect_limit(get(server.port(), "/v1"), 429, "1 requests a second");
}

TEST(Limits, StreamWithTooManyMessagesIsThrottled) {
  ServerOptions options;
  options.limits.messages_per_address = 20;  // burst of 40
  TestServer server(options);
  StreamClient viewer(server.port());
  const auto since = std::chrono::steady_clock::now();
  for (int n = 1; n <= 80; ++n) viewer.say(R"({"type":"no such message"})");
  for (int n = 1; n <= 80; ++n) ASSERT_TRUE(viewer.next_text("error")) << n;
  EXPECT_GT(std::chrono::steady_clock::now() - since, std::chrono::milliseconds(1500));
}

TEST(Limits, ConnectionsOfOneAddressAreLimited) {
  ServerOptions options;
  options.limits.connections_per_address = 2;
  TestServer server(options);
  const auto held = hold(server.port(), 2);
  expect_limit(get(server.port(), "/v1"), 429, "--max-connections-per-address");
  EXPECT_EQ(get(server.port(), "/readyz").status, 200);
}

// Silent connections hold their slots for two seconds; others are closed meanwhile.
TEST(Limits, ReservedConnectionsAreBoundedAndReleased) {
  ServerOptions options;
  options.limits.connections = 1;
  TestServer server(options);
  const auto held = hold(server.port(), 1);
  std::vector<std::unique_ptr<Socket>> silent;
  for (int n = 0; n < 100; ++n) silent.push_back(std::make_unique<Socket>(server.port()));
  Socket late(server.port());
  late.send("GET /livez HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(read_answer(late).status, 0) << "closed at once";
  EXPECT_TRUE(comes_true([&] { return get(server.port(), "/livez").status == 200; }));
  for (std::size_t n = 0; n < silent.size(); ++n) EXPECT_TRUE(silent[n]->closed_by_peer()) << n;
  const Exposition read = parse_exposition(get(server.port(), "/metrics").body);
  EXPECT_GE(read.value("windsplat_connections_refused_total"), 84);
}

TEST(Limits, SessionsOfOneAddressAreLimited) {
  ServerOptions options;
  options.limits.sessions_per_address = 2;
  TestServer server(options);
  auto first = std::make_unique<StreamClient>(server.port());
  StreamClient second(server.port());
  EXPECT_EQ(first->handshake().status, 101);
  EXPECT_EQ(second.handshake().status, 101);
  const StreamClient third(server.port());
  expect_no_upgrade(third, 429);
  EXPECT_EQ(refused(server.port(), "address_sessions"), 1);
  first.reset();
  EXPECT_TRUE(comes_true([&] { return StreamClient(server.port()).handshake().status == 101; }));
}

TEST(Limits, RequestsAboveTheirRateAreRefusedExceptHealth) {
  ServerOptions options;
  options.limits.requests_per_address = 2;  // burst of 20
  TestServer server(options);
  int answered = 0;
  Answer last;
  while ((last = get(server.port(), "/v1")).status == 200 && answered < 100) ++answered;
  EXPECT_GE(answered, 20);
  EXPECT_LT(answered, 60) << "the test itself takes time";
  expect_limit(last, 429, "2 requests a second");
  EXPECT_EQ(get(server.port(), "/livez").status, 200);
  EXPECT_GE(refused(server.port(), "requests"), 1);
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  EXPECT_EQ(get(server.port(), "/v1").status, 200);
}

TEST(Limits, RenderingIsChargedAndItsDebtDelaysRequests) {
  ServerOptions options;
  options.limits.render_s_per_address = 0.0001;
  TestServer server(options);
  const std::string frame = "/v1/datasets/small/frame.jpg?width=64&height=48";
  EXPECT_EQ(get(server.port(), frame).status, 200) << "the first may exceed the limit";
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // it is charged once it is answered
  const Answer second = get(server.port(), frame);
  expect_limit(second, 429, "seconds of rendering a minute");
  EXPECT_GT(std::atoi(second.header("retry-after").c_str()), 10);
  expect_limit(post_view(server.port(), R"({"dataset":"small"})"), 429, "seconds of rendering");
  expect_limit(request(server.port(), "POST", "/v1/references",
                       {{"Content-Type", "application/json"}}, R"({"dataset":"small"})"),
               429, "seconds of rendering");
  expect_no_upgrade(StreamClient(server.port()), 429);
  EXPECT_EQ(get(server.port(), "/v1/datasets").status, 200)
      << "requests without rendering are answered";
  EXPECT_EQ(refused(server.port(), "render"), 4);
}

TEST(Limits, StreamAboveItsQuotaIsClosed) {
  ServerOptions options;
  options.limits.render_s_per_address = 0.0001;
  TestServer server(options);
  StreamClient viewer(server.port());
  viewer.say(
      R"({"type":"patch","rev":1,"patch":{"dataset":"small","image":{"width":64,"height":48}}})");
  ASSERT_TRUE(viewer.next_frame());
  viewer.say(R"({"type":"ack","seq":1,"decodeMs":1})");
  viewer.say(R"({"type":"patch","rev":2,"patch":{"camera":{"eye":[0,-3,1]}}})");
  EXPECT_EQ(viewer.close_code(), 1013);
}

TEST(Limits, BytesSentAreCharged) {
  ServerOptions options;
  options.limits.bytes_per_address = 1;  // burst of 10
  TestServer server(options);
  EXPECT_EQ(get(server.port(), "/v1").status, 200);
  EXPECT_TRUE(comes_true([&] {
    const Answer answer = get(server.port(), "/v1/datasets/small/frame.jpg?width=64&height=48");
    return answer.status == 429 && answer.body.find("bytes a second") != std::string::npos;
  }));
}

TEST(Limits, ClientsBehindATrustedProxyAreDistinguished) {
  ServerOptions options;
  options.limits.requests_per_address = 0.1;  // one, and no other within ten seconds
  options.limits.trusted_proxies = {"127.0.0.1"};
  TestServer server(options);
  const auto ask = [&](const std::string& hops) {
    return get(server.port(), "/v1", {{"X-Forwarded-For", hops}}).status;
  };
  EXPECT_EQ(ask("198.51.100.1"), 200);
  EXPECT_EQ(ask("203.0.113.5, 198.51.100.1"), 429);
  EXPECT_EQ(ask("198.51.100.2"), 200);
  options.limits.trusted_proxies = {};
  TestServer wary(options);
  EXPECT_EQ(get(wary.port(), "/v1", {{"X-Forwarded-For", "198.51.100.1"}}).status, 200);
  EXPECT_EQ(get(wary.port(), "/v1", {{"X-Forwarded-For", "198.51.100.2"}}).status, 429);
}

TEST(Limits, OversizeOrExpensivePicturesAreRefusedBeforeLoading) {
  ServerOptions options;
  options.limits.pixels = 100 * 100;
  options.limits.kernels = 1e6;
  TestServer server(options);
  const std::string small = R"("image":{"width":100,"height":100})";
  const Answer large =
      post_view(server.port(), R"({"dataset":"small","image":{"width":101,"height":100}})");
  EXPECT_EQ(large.status, 413) << large.body;
  EXPECT_EQ(json_of(large)["errors"][0]["pointer"], "/image");
  EXPECT_EQ(get(server.port(), "/v1/datasets/small/frame.jpg?width=101&height=100").status, 413);
  const std::string dear =
      R"({"dataset":"small","vector":{"r1":60,"r2":64,"length":10,"span":64},)" + small + "}";
  const Answer refusal = post_view(server.port(), dear);
  EXPECT_EQ(refusal.status, 422) << refusal.body;
  EXPECT_THAT(std::string(json_of(refusal)["errors"][0]["pointer"]), HasSubstr("/vector/"));
  EXPECT_THAT(std::string(json_of(refusal)["errors"][0]["detail"]), HasSubstr("1e+06"));
  for (const char* to : {"/v1/references", "/v1/forecasts"}) {
    EXPECT_EQ(
        request(server.port(), "POST", to, {{"Content-Type", "application/json"}}, dear).status,
        422)
        << to;
  }
  EXPECT_EQ(server.loads(), 0U);
  EXPECT_EQ(json_of(get(server.port(), "/v1"))["limits"]["imagePixelsMax"], 10'000);
  StreamClient viewer(server.port());
  const auto hello = viewer.next_text("hello");
  ASSERT_TRUE(hello);
  EXPECT_EQ(Json::parse(*hello)["limits"]["imagePixelsMax"], 10'000);
  viewer.say(R"({"type":"patch","rev":1,"patch":)" + dear + "}");
  const auto told = viewer.next_text("error");
  ASSERT_TRUE(told);
  EXPECT_EQ(Json::parse(*told)["problem"]["status"], 422);
  viewer.say(R"({"type":"patch","rev":2,"patch":{"dataset":"small",)" + small + "}}");
  ASSERT_TRUE(viewer.next_frame());
  viewer.texts.clear();
  viewer.say(R"({"type":"still","id":5,"width":200,"height":200,"format":"png","scale":1})");
  // Refining frames may come first and use the credit until they are acknowledged.
  std::optional<std::string> still;
  for (int seq = 1; !still;) {
    viewer.say(R"({"type":"ack","decodeMs":1,"seq":)" + std::to_string(seq) + "}");
    const auto message = viewer.next(20'000);
    ASSERT_TRUE(message);
    if (message->kind == Opcode::binary) ++seq;
    if (message->kind == Opcode::text && Json::parse(message->data)["type"] == "error") {
      still = message->data;
    }
  }
  EXPECT_EQ(Json::parse(*still)["problem"]["status"], 413) << *still;
  EXPECT_GE(refused(server.port(), "pixels"), 3);
  EXPECT_GE(refused(server.port(), "kernels"), 4);
}

TEST(Limits, EveryResponseHasSecurityHeaders) {
  TestServer server;
  const auto answers = {get(server.port(), "/v1"),
                        get(server.port(), "/nothing"),
                        get(server.port(), "/livez"),
                        get(server.port(), "/"),
                        get(server.port(), "/v1/datasets/small/frame.jpg?width=32&height=32"),
                        request(server.port(), "OPTIONS", "/v1"),
                        raw(server.port(), "nonsense\r\n\r\n")};
  for (const Answer& answer : answers) {
    SCOPED_TRACE(answer.status);
    EXPECT_EQ(answer.header("x-content-type-options"), "nosniff");
    EXPECT_EQ(answer.header("referrer-policy"), "no-referrer");
    EXPECT_THAT(answer.header("permissions-policy"), HasSubstr("camera=()"));
    EXPECT_THAT(answer.header("content-security-policy"), HasSubstr("default-src 'none'"));
    EXPECT_FALSE(answer.header("cross-origin-resource-policy").empty());
    EXPECT_FALSE(answer.header("cache-control").empty());
  }
}

// The number of series is constant for all requests.
TEST(Limits, PathsMethodsAndRefusalsCreateNoMetricSeries) {
  ServerOptions options;
  options.limits.sessions_per_address = 1;
  options.limits.pixels = 10'000;
  TestServer server(options);
  const auto series = [&] {
    return parse_exposition(get(server.port(), "/metrics").body).samples.size();
  };
  const std::size_t before = series();
  EXPECT_GT(before, 100U);
  for (const char* path : {"/v1/%00", "/%ff", "/v1/datasets/a%22b/frame.jpg", "/metrics/x",
                           "/v1/jobs/%0d%0a", "/v1/views/../../x", "/livez?a=b"}) {
    for (const char* method : {"GET", "POST", "DELETE", "PATCH", "TRACE", "X"}) {
      request(server.port(), method, path, {{"X-Request-Id", "a\"b{}"}}, "{}");
    }
  }
  const StreamClient one(server.port());
  const StreamClient two(server.port());
  get(server.port(), "/v1/datasets/small/frame.jpg");
  EXPECT_EQ(series(), before);
}

// Pictures whose data are not resident wait in the load queue, which is bounded too.
TEST(Limits, PicturesWaitingForASlowDiskAreBounded) {
  namespace data = windsplat::data;
  const auto gate = std::make_shared<Gate>();
  TestServer server(
      {},
      [gate](const data::Location& location,
             const windsplat::CancelToken&) -> windsplat::Result<std::unique_ptr<data::Source>> {
        auto source = data::open_dataset(data::direct_files(location));
        if (!source) return source.error();
        return std::unique_ptr<data::Source>(
            std::make_unique<SlowSource>(std::move(*source), gate));
      });
  const std::string frame = "GET /v1/datasets/small/frame.jpg?width=32&height=32 HTTP/1.1\r\n";
  std::vector<std::unique_ptr<Socket>> waiting;
  for (int n = 0; n < 40; ++n) {
    waiting.push_back(std::make_unique<Socket>(server.port()));
    waiting.back()->send(frame + "Host: x\r\n\r\n");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ASSERT_TRUE(gate->wait_for(1));
  EXPECT_TRUE(comes_true([&] { return refused(server.port(), "waiting") >= 20; }));
  gate->open();
  int served = 0;
  for (const auto& socket : waiting) {
    const Answer answer = read_answer(*socket);
    if (answer.status != 200) expect_limit(answer, 429, "try again");
    served += answer.status == 200 ? 1 : 0;
  }
  EXPECT_GE(served, 8);  // half of the slots: all requests are from one address
  EXPECT_LE(served, 12);
}

// The renderer is free soon after the client of an expensive picture disconnects, even if a byte of
// another request precedes the close; likewise for a stream. The requirement is 100 ms; machines
// that run many tests at once get thirty times that.
TEST(Cancel, DisconnectCancelsTheRendering) {
  TestServer server;
  const std::string view = R"({"dataset":"small","image":{"width":4096,"height":4096},)"
                           R"("vector":{"r1":60,"r2":64,"length":3,"span":64},)"
                           R"("method":{"slabThickness":0.05}})";
  const std::string post =
      "POST /v1/frames HTTP/1.1\r\nHost: x\r\nAccept: image/png\r\nContent-Type: "
      "application/json\r\nContent-Length: " +
      std::to_string(view.size()) + "\r\n\r\n" + view;
  ASSERT_EQ(get(server.port(), "/v1/datasets/small/frame.jpg?width=32&height=32").status, 200);
  const auto time_of_next = [&] {
    const auto since = std::chrono::steady_clock::now();
    EXPECT_EQ(get(server.port(), "/v1/datasets/small/frame.jpg?width=32&height=32").status, 200);
    return std::chrono::steady_clock::now() - since;
  };
  for (const std::string next : {"", "G"}) {
    auto leaving = std::make_unique<Socket>(server.port());
    leaving->send(post + next);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    EXPECT_EQ(leaving->receive(1), "") << "the picture takes longer than that";
    leaving.reset();
    EXPECT_LT(time_of_next(), std::chrono::seconds(3)) << next;
  }
  auto viewer = std::make_unique<StreamClient>(server.port());
  viewer->say(R"({"type":"patch","rev":1,"patch":{"dataset":"small"}})");
  ASSERT_TRUE(viewer->next_frame());
  viewer->say(R"({"type":"patch","rev":2,"patch":)" + view + "}");
  viewer->say(R"({"type":"still","id":1,"width":4096,"height":4096,"format":"png","scale":1})");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  viewer.reset();
  EXPECT_LT(time_of_next(), std::chrono::seconds(3));
}

}  // namespace
}  // namespace server_test
