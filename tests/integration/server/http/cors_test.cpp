// Scripts of pages of other origins: preflights, and which answers they may read.
#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>

#include "server/access/auth.hpp"
#include "server/uploads/uploads.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;
using windsplat::access::Token;
using windsplat::api::ServerOptions;

const std::string cors_secret = "correct-horse_battery.staple";
const std::string cors_friend = "https://friend.example";

ServerOptions cors_options() {
  ServerOptions options;
  options.token = std::make_shared<const Token>(Token::parse(cors_secret).value());
  options.allow_origins = {cors_friend, "https://other.example"};
  return options;
}

Headers cors_from(const std::string& origin, const Headers& more = {}) {
  Headers headers{{"Origin", origin}};
  headers.insert(headers.end(), more.begin(), more.end());
  return headers;
}

const Headers cors_asks{{"Access-Control-Request-Method", "POST"},
                        {"Access-Control-Request-Headers", "authorization,content-type"}};
const Headers cors_bearer{{"Authorization", "Bearer " + cors_secret}};

void expect_shared(const Answer& answer, const std::string& what) {
  EXPECT_EQ(answer.header("access-control-allow-origin"), cors_friend) << what;
  EXPECT_EQ(answer.header("access-control-allow-credentials"), "") << what;
  EXPECT_THAT(answer.header("vary"), HasSubstr("Origin")) << what;
  for (const char* const name :
       {"Windsplat-Frame", "Windsplat-Values", "Server-Timing", "X-Request-Id", "Location", "ETag",
        "Retry-After", "RateLimit", "RateLimit-Policy"}) {
    EXPECT_THAT(answer.header("access-control-expose-headers"), HasSubstr(name)) << what;
  }
}

// They tell a server that is down from one that refuses them.
TEST(CrossOrigin, PagesOfAnyOriginLearnThatHealthIsAnsweredAndNotWhatItSays) {
  const TestServer server(cors_options());
  for (const char* const target : {"/livez", "/readyz"}) {
    const Answer answer = get(server.port(), target, cors_from("https://stranger.example"));
    EXPECT_EQ(answer.status, 200) << target;
    EXPECT_EQ(answer.header("cross-origin-resource-policy"), "cross-origin") << target;
    EXPECT_EQ(answer.header("access-control-allow-origin"), "") << target;
  }
}

TEST(CrossOrigin, APreflightOfAListedOriginIsAnsweredBeforeAuthentication) {
  const TestServer server(cors_options());
  for (const char* const target : {"/v1/frames", "/v1/views/x", "/unknown"}) {
    const Answer answer =
        request(server.port(), "OPTIONS", target, cors_from(cors_friend, cors_asks));
    EXPECT_EQ(answer.status, 204) << target;
    expect_shared(answer, target);
    EXPECT_THAT(answer.header("access-control-allow-methods"), HasSubstr("PATCH"));
    for (const char* const name : {"Authorization", "Content-Digest", "Content-Type", "If-Match",
                                   "If-None-Match", "Accept", "Repr-Digest"}) {
      EXPECT_THAT(answer.header("access-control-allow-headers"), HasSubstr(name));
    }
    EXPECT_GT(std::stoi(answer.header("access-control-max-age")), 0);
  }
}

TEST(CrossOrigin, AnOriginThatIsNotListedGetsNoneOfIt) {
  const TestServer server(cors_options());
  for (const char* const origin :
       {"https://evil.example", "http://friend.example", "https://friend.example:8443", "null"}) {
    const Answer asked =
        request(server.port(), "OPTIONS", "/v1/frames", cors_from(origin, cors_asks));
    EXPECT_EQ(asked.status, 401) << origin;
    const Answer read = get(server.port(), "/v1", cors_from(origin, cors_bearer));
    EXPECT_EQ(read.status, 200) << origin;
    const Answer changed = post_view(server.port(), "{}", cors_from(origin, cors_bearer));
    EXPECT_EQ(changed.status, 403) << origin;
    for (const Answer* const answer : {&asked, &read, &changed}) {
      EXPECT_EQ(answer->header("access-control-allow-origin"), "") << origin;
      EXPECT_EQ(answer->header("access-control-allow-methods"), "") << origin;
      EXPECT_EQ(answer->header("access-control-expose-headers"), "") << origin;
      EXPECT_THAT(answer->header("vary"), HasSubstr("Origin")) << "for caches";
    }
  }
}

TEST(CrossOrigin, ScriptsOfListedOriginsReadEveryAnswerAlsoErrors) {
  const TestServer server(cors_options());
  const auto port = server.port();
  const Answer service = get(port, "/v1", cors_from(cors_friend, cors_bearer));
  EXPECT_EQ(service.status, 200);
  expect_shared(service, "200");
  const Answer denied = get(port, "/v1", cors_from(cors_friend));
  EXPECT_EQ(denied.status, 401);
  expect_shared(denied, "401");
  const Answer invalid =
      post_view(port, R"({"dataset":"small","no":1})", cors_from(cors_friend, cors_bearer));
  EXPECT_EQ(invalid.status, 422);
  expect_shared(invalid, "422");
  const std::string view = R"({"dataset":"small","image":{"width":16,"height":16}})";
  const Answer picture = post_view(port, view, cors_from(cors_friend, cors_bearer));
  EXPECT_EQ(picture.status, 200);
  expect_shared(picture, "a picture");
  EXPECT_EQ(picture.header("cross-origin-resource-policy"), "cross-origin");
}

TEST(CrossOrigin, RequestsOverTheRateAreReadableAndPreflightsAreCounted) {
  ServerOptions options = cors_options();
  options.limits.requests_per_address = 0.2;  // two at once, then one in five seconds
  const TestServer server(options);
  const Headers asks = cors_from(cors_friend, cors_asks);
  EXPECT_EQ(request(server.port(), "OPTIONS", "/v1", asks).status, 204);
  EXPECT_EQ(request(server.port(), "OPTIONS", "/v1", asks).status, 204);
  EXPECT_EQ(request(server.port(), "OPTIONS", "/v1", asks).status, 429);
  const Answer over = get(server.port(), "/v1", cors_from(cors_friend, cors_bearer));
  EXPECT_EQ(over.status, 429);
  expect_shared(over, "429");
  EXPECT_NE(over.header("retry-after"), "");
}

TEST(CrossOrigin, WithoutListedOriginsNothingIsShared) {
  const TestServer server;
  const Answer answer = get(server.port(), "/v1", cors_from(cors_friend));
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.header("access-control-allow-origin"), "");
  EXPECT_THAT(answer.header("vary"), testing::Not(HasSubstr("Origin")));
}

// A preflight keeps the connection, and is counted by its own name.
TEST(CrossOrigin, APreflightKeepsItsConnectionAndHasItsOwnNameInTheMetrics) {
  const TestServer server(cors_options());
  Socket socket(server.port());
  for (int n = 0; n < 2; ++n) {
    socket.send("OPTIONS /v1/frames HTTP/1.1\r\nHost: x\r\nOrigin: " + cors_friend +
                "\r\nAccess-Control-Request-Method: POST\r\nContent-Length: 2\r\n\r\n{}");
    EXPECT_EQ(read_answer(socket).status, 204);
  }
  EXPECT_THAT(get(server.port(), "/metrics", cors_bearer).body,
              HasSubstr(R"(route="preflight",status="2xx"} 2)"));
}

// Uploads may be long, but nobody takes the body of a preflight, which needs no token.
TEST(CrossOrigin, APreflightHasNoLargeBodyAlsoWhereUploadsMayBe) {
  std::string folder =
      (std::filesystem::temp_directory_path() / "windsplat-preflight-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  ServerOptions options = cors_options();
  options.uploads = windsplat::uploads::Uploads::open({folder + "/uploads", 1U << 30U}).value();
  {
    const TestServer server(std::move(options));
    Socket socket(server.port());
    socket.send("OPTIONS /v1/uploads/a.nc HTTP/1.1\r\nHost: x\r\nOrigin: " + cors_friend +
                "\r\nAccess-Control-Request-Method: PUT\r\nContent-Length: 1000000\r\n\r\n");
    const Answer answer = read_answer(socket);  // before any of it is sent
    EXPECT_EQ(answer.status, 413);
    expect_shared(answer, "413");
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace server_test
