// What clients are told of their rates, over HTTP.
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

TEST(RateHeaders, TellWhatIsLeftUntilARequestIsRefused) {
  windsplat::api::ServerOptions options;
  options.limits.requests_per_address = 0.3;  // three at once, then one in 3.3 s
  const TestServer server(options);
  for (const char* const left : {"2", "1", "0"}) {
    const Answer answer = get(server.port(), "/v1");
    EXPECT_EQ(answer.status, 200);
    EXPECT_EQ(answer.header("ratelimit-policy"), R"("requests";q=3;w=10)");
    EXPECT_EQ(answer.header("ratelimit").substr(0, 15),
              std::string(R"("requests";r=)") + left + ";")
        << answer.header("ratelimit");
  }
  const Answer refused = get(server.port(), "/v1");
  EXPECT_EQ(refused.status, 429);
  EXPECT_EQ(refused.header("ratelimit").substr(0, 15), R"("requests";r=0;)");
  EXPECT_GE(std::stoi(refused.header("retry-after")), 1);
  const Answer health = get(server.port(), "/livez");
  EXPECT_EQ(health.status, 200);
  EXPECT_EQ(health.header("ratelimit").substr(0, 15), R"("requests";r=2;)");
}

TEST(RateHeaders, AreAbsentWithoutLimits) {
  windsplat::api::ServerOptions options;
  options.limits.requests_per_address = 0;
  const TestServer server(options);
  const Answer answer = get(server.port(), "/v1");
  EXPECT_EQ(answer.header("ratelimit"), "");
  EXPECT_EQ(answer.header("ratelimit-policy"), "");
}

TEST(RateHeaders, AJobSaysWhenToAskForIt) {
  const TestServer server;
  const Answer job = request(server.port(), "POST", "/v1/references", json_type,
                             R"({"dataset":"small","image":{"width":8,"height":8}})");
  ASSERT_EQ(job.status, 202) << job.body;
  EXPECT_EQ(job.header("retry-after"), "1");
  EXPECT_EQ(get(server.port(), job.header("location")).header("retry-after"), "");
}

}  // namespace
}  // namespace server_test
