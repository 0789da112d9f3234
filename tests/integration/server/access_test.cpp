// A server with a token: authentication over HTTP and WebSocket by each credential.
#include <gmock/gmock.h>

#include "server/access/auth.hpp"
#include "server/base/log.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

namespace log = windsplat::log;
using testing::HasSubstr;
using testing::Not;
using windsplat::access::Token;
using windsplat::api::ServerOptions;
using windsplat::transport::Access;

const std::string secret = "correct-horse_battery.staple";
const std::string secret_in_base64url = "Y29ycmVjdC1ob3JzZV9iYXR0ZXJ5LnN0YXBsZQ";
const Headers bearer{{"Authorization", "Bearer " + secret}};
const Headers browser{{"Accept", "text/html,*/*;q=0.8"}};

std::shared_ptr<const Token> token(const std::string& text = secret) {
  return std::make_shared<const Token>(Token::parse(text).value());
}

ServerOptions guarded() {
  ServerOptions options;
  options.token = token();
  options.allow_origins = {"https://friend.example"};
  return options;
}

class Guarded : public testing::Test {
 protected:
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  [[nodiscard]] std::string origin() const { return "http://127.0.0.1:" + std::to_string(port()); }

  Answer log_in(const std::string& text, Headers headers = {}) const {
    if (headers.empty()) headers.emplace_back("Origin", origin());
    headers.emplace_back("Content-Type", "application/x-www-form-urlencoded");
    return request(port(), "POST", "/login", headers, "token=" + text);
  }
  [[nodiscard]] Headers with_cookie() const {
    const std::string cookie = log_in(secret).header("set-cookie");
    return {{"Cookie", cookie.substr(0, cookie.find(';'))}};
  }

  TestServer server_{guarded()};
};

Headers operator+(Headers a, const Headers& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST_F(Guarded, HealthNeedsNoToken) {
  EXPECT_EQ(get(port(), "/livez").status, 200);
  EXPECT_EQ(get(port(), "/readyz").status, 200);
}

TEST_F(Guarded, WhatIsRefusedCountsByItsRoute) {
  get(port(), "/v1/datasets");
  get(port(), "/v1/datasets/small", {{"Authorization", "Bearer wrong"}});
  get(port(), "/none");
  const std::string metrics = get(port(), "/metrics", bearer).body;
  for (const char* route : {"/v1/datasets", "/v1/datasets/{id}", "other"}) {
    EXPECT_THAT(metrics, HasSubstr("route=\"" + std::string(route) + "\",status=\"4xx\"} 1\n"));
  }
}

TEST_F(Guarded, EverythingElseNeedsAToken) {
  for (const char* target : {"/", "/v1", "/v1/datasets", "/metrics", "/view.schema.json", "/none",
                             "/v1/datasets/small/frame.jpg?width=20&height=20", "/login"}) {
    for (const Headers& wrong : {Headers{}, Headers{{"Authorization", "Bearer " + secret + "x"}},
                                 Headers{{"Cookie", "windsplat=1.2"}}}) {
      const Answer answer = get(port(), target, wrong);
      EXPECT_EQ(answer.status, 401) << target;
      EXPECT_THAT(answer.header("www-authenticate"), HasSubstr("Bearer"));
      EXPECT_EQ(answer.header("content-type"), "application/problem+json");
    }
  }
  EXPECT_EQ(post_view(port(), R"({"dataset":"small"})").status, 401);
  EXPECT_EQ(request(port(), "DELETE", "/v1/datasets/small").status, 401);
  EXPECT_EQ(request(port(), "OPTIONS", "/v1").status, 401);
}

TEST_F(Guarded, TokenGrantsAccessToEverything) {
  for (const char* target : {"/", "/v1", "/metrics"}) {
    EXPECT_EQ(get(port(), target, bearer).status, 200) << target;
  }
  const std::string view = R"({"dataset":"small","image":{"width":16,"height":16}})";
  EXPECT_EQ(post_view(port(), view, bearer).status, 200);
  EXPECT_EQ(post_view(port(), view, bearer + Headers{{"Origin", "https://evil.example"}}).status,
            403);
  EXPECT_EQ(post_view(port(), view, bearer + Headers{{"Origin", "https://friend.example"}}).status,
            200);
}

// The body of an unauthenticated request is not read, so the connection is closed.
TEST_F(Guarded, UnauthorizedRequestIsRefusedBeforeItsBody) {
  Socket socket(port());
  socket.send("POST /v1/frames HTTP/1.1\r\nHost: x\r\nContent-Length: 60000\r\n\r\n");
  const Answer answer = read_answer(socket);
  EXPECT_EQ(answer.status, 401);
  EXPECT_EQ(answer.header("connection"), "close");
}

TEST_F(Guarded, WebSocketIsAuthenticatedBeforeTheUpgrade) {
  const auto status = [&](const Headers& headers) {
    return StreamClient(port(), headers).handshake().status;
  };
  const Headers offer{{"Sec-WebSocket-Protocol", "windsplat.v1, bearer." + secret_in_base64url}};
  EXPECT_EQ(status({}), 401);
  EXPECT_EQ(status({{"Sec-WebSocket-Protocol", "windsplat.v1"}}), 401);
  EXPECT_EQ(status({{"Sec-WebSocket-Protocol", "windsplat.v1, bearer.d3Jvbmc"}}), 401);
  EXPECT_EQ(status(bearer), 101);
  EXPECT_EQ(status(bearer + Headers{{"Origin", "https://evil.example"}}), 403);
  EXPECT_EQ(status(bearer + Headers{{"Origin", "https://friend.example"}}), 101);
  EXPECT_EQ(status(with_cookie()), 403) << "browsers send the origin of their page";
  EXPECT_EQ(status(with_cookie() + Headers{{"Origin", "http://evil.example"}}), 403);
  EXPECT_EQ(status(with_cookie() + Headers{{"Origin", origin()}}), 101);
  StreamClient viewer(port(), offer);
  EXPECT_EQ(viewer.handshake().status, 101);
  EXPECT_EQ(viewer.handshake().header("sec-websocket-protocol"), "windsplat.v1");
  EXPECT_TRUE(viewer.next_text("hello"));
}

TEST_F(Guarded, LoginCookieGrantsAccess) {
  const Answer form = get(port(), "/", browser);
  EXPECT_EQ(form.status, 401);
  EXPECT_THAT(form.header("content-type"), HasSubstr("text/html"));
  EXPECT_THAT(form.body, HasSubstr("action=\"/login\""));
  EXPECT_EQ(log_in("wrong").status, 401);
  EXPECT_EQ(log_in("wrong").header("set-cookie"), "");
  const Answer in = log_in(secret);
  EXPECT_EQ(in.status, 303);
  EXPECT_EQ(in.header("location"), "/");
  EXPECT_THAT(in.header("set-cookie"), HasSubstr("HttpOnly; SameSite=Strict"));
  EXPECT_THAT(in.header("set-cookie"), Not(HasSubstr(secret)));
  const Headers cookie = with_cookie();
  EXPECT_EQ(get(port(), "/", browser + cookie).status, 200);
  const Headers json{{"Content-Type", "application/json"}};
  const auto keep = [&](const Headers& more) {
    return request(port(), "POST", "/v1/views", json + cookie + more, R"({"step":1})").status;
  };
  EXPECT_EQ(keep({{"Origin", origin()}}), 201);
  EXPECT_EQ(keep({{"Sec-Fetch-Site", "same-origin"}}), 201);
  EXPECT_EQ(keep({{"Origin", "https://evil.example"}}), 403);
  EXPECT_EQ(keep({}), 403);
}

TEST_F(Guarded, LoginIsAcceptedFromTheOwnPageOnly) {
  EXPECT_EQ(log_in(secret, {{"Origin", "https://evil.example"}}).status, 403);
  EXPECT_EQ(log_in(secret, {{"X", "no origin"}}).status, 403);
  EXPECT_EQ(request(port(), "POST", "/login", {{"Origin", origin()}}, "token=" + secret).status,
            415);
}

TEST_F(Guarded, TokenInAUrlIsRefused) {
  for (const std::string key : {"token", "access_token"}) {
    EXPECT_EQ(get(port(), "/?" + key + "=" + secret).status, 400);
    EXPECT_EQ(get(port(), "/v1?" + key + "=" + secret, bearer).status, 400);
    EXPECT_EQ(StreamClient(port(), {}, "/v1/stream?" + key + "=" + secret).handshake().status, 400);
  }
}

// Correct tokens are refused too: otherwise the limit would not slow down guessing.
TEST(GuardedAttempts, AreRefusedBeyondTheLimitWhileCookiesAreAccepted) {
  ServerOptions options = guarded();
  options.limits.failed_logins_per_address = 4;
  TestServer server(options);
  const auto port = server.port();
  const std::string origin = "http://127.0.0.1:" + std::to_string(port);
  const Headers form{{"Origin", origin}, {"Content-Type", "application/x-www-form-urlencoded"}};
  const auto log_in = [&](const std::string& text) {
    return request(port, "POST", "/login", form, "token=" + text);
  };
  const Headers offer{{"Sec-WebSocket-Protocol", "windsplat.v1, bearer." + secret_in_base64url}};
  const std::string set = log_in(secret).header("set-cookie");
  const Headers cookie{{"Cookie", set.substr(0, set.find(';'))}};
  const Headers wrong{{"Authorization", "Bearer guess"}};
  EXPECT_EQ(get(port, "/v1", wrong).status, 401);
  EXPECT_EQ(log_in("guess").status, 401);
  EXPECT_EQ(get(port, "/v1", bearer).status, 200) << "within the limit";
  EXPECT_EQ(get(port, "/v1", wrong).status, 401);
  EXPECT_EQ(log_in("guess").status, 401);
  for (const Answer& over : {get(port, "/v1", wrong), get(port, "/v1", bearer), log_in("guess"),
                             log_in(secret), StreamClient(port, offer).handshake()}) {
    EXPECT_EQ(over.status, 429);
    EXPECT_NE(over.header("retry-after"), "");
    EXPECT_EQ(over.header("set-cookie"), "");
  }
  EXPECT_EQ(get(port, "/v1", cookie).status, 200);
  EXPECT_EQ(get(port, "/livez", wrong).status, 200);
  EXPECT_EQ(get(port, "/v1").status, 401);
}

TEST_F(Guarded, NewTokenRevokesCookiesAndStreams) {
  const Headers cookie = with_cookie();
  StreamClient viewer(port(), bearer);
  ASSERT_TRUE(viewer.next_text("hello"));
  // Reloading the same token closes no session.
  server_.server().change(Access{{}, token(), nullptr, false, {}});
  EXPECT_EQ(get(port(), "/v1", cookie).status, 200);
  viewer.say(R"({"type":"open","id":1,"dataset":"small"})");
  EXPECT_TRUE(viewer.next_text("opened"));
  server_.server().change(Access{{}, token("another-token-of-ours"), nullptr, false, {}});
  EXPECT_EQ(viewer.close_code(), 1008);
  EXPECT_EQ(get(port(), "/v1", cookie).status, 401);
  EXPECT_EQ(get(port(), "/v1", bearer).status, 401);
  EXPECT_EQ(get(port(), "/v1", {{"Authorization", "Bearer another-token-of-ours"}}).status, 200);
}

TEST(GuardedLog, ContainsNeitherTheTokenNorAttempts) {
  log::configure(log::Format::json, log::Level::debug);
  testing::internal::CaptureStderr();
  {
    TestServer server(guarded());
    const auto port = server.port();
    const std::string origin = "http://127.0.0.1:" + std::to_string(port);
    const Headers form{{"Origin", origin}, {"Content-Type", "application/x-www-form-urlencoded"}};
    EXPECT_EQ(request(port, "POST", "/login", form, "token=" + secret).status, 303);
    EXPECT_EQ(request(port, "POST", "/login", form, "token=almost-the-right-token").status, 401);
    get(port, "/v1", bearer);
    get(port, "/v1", {{"Authorization", "Bearer almost-the-right-token"}});
    get(port, "/v1?token=" + secret);
    get(port, "/?access_token=" + secret, browser);
    get(port, "/" + secret);
    StreamClient(port, {{"Sec-WebSocket-Protocol", "bearer." + secret_in_base64url}});
  }
  const std::string told = testing::internal::GetCapturedStderr();
  log::configure(log::Format::text, log::Level::info);
  EXPECT_THAT(told, HasSubstr("\"status\":401"));
  EXPECT_THAT(told, HasSubstr("login failed"));
  for (const std::string& hidden : {secret, secret_in_base64url, std::string("almost-the-right")}) {
    EXPECT_THAT(told, Not(HasSubstr(hidden)));
  }
}

}  // namespace
}  // namespace server_test
