// Types of problems over HTTP, in jobs and in the stream: each is the path of a page.
#include <gmock/gmock.h>

#include <fstream>

#include "server/access/auth.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using windsplat::api::ServerOptions;

// The slug of a type below the base path, whose page must exist.
std::string slug_with_page(const TestServer& server, const std::string& base, const Json& problem) {
  const std::string type = problem["type"].get<std::string>();
  EXPECT_THAT(type, StartsWith(base + "problems/"));
  const std::string slug = type.substr(type.rfind('/') + 1);
  const Answer page = get(server.port(), type);
  EXPECT_EQ(page.status, 200) << type;
  EXPECT_THAT(page.body, StartsWith(slug + ": " + std::to_string(problem["status"].get<int>())));
  return slug;
}

TEST(ProblemPages, TheTypeOfEveryErrorIsThePathOfItsPage) {
  ServerOptions options;
  options.base_path = "/a/b/";
  const TestServer server(options);
  const auto slug_of = [&](const std::string& method, const std::string& target,
                           const Headers& headers = {}, const std::string& body = "") {
    return slug_with_page(server, "/a/b/",
                          json_of(request(server.port(), method, target, headers, body)));
  };
  EXPECT_EQ(slug_of("GET", "/a/b/none"), "not-found");
  EXPECT_EQ(slug_of("GET", "/elsewhere"), "not-found");
  EXPECT_EQ(slug_of("GET", "/a/b/v1?x=1"), "malformed");
  EXPECT_EQ(slug_of("DELETE", "/a/b/v1"), "method-not-allowed");
  EXPECT_EQ(slug_of("POST", "/a/b/v1/frames", json_type, R"({"dataset":"small","no":1})"),
            "invalid-value");
  EXPECT_EQ(slug_of("POST", "/a/b/v1/frames", {{"Content-Type", "text/csv"}}, "a,b"),
            "unsupported-media-type");
  EXPECT_EQ(slug_of("GET", "/a/b/v1/stream"), "upgrade-required");
  EXPECT_EQ(slug_of("BREW", "/a/b/v1"), "not-implemented");
  EXPECT_EQ(slug_of("GET", "/a/b/v1", {{"Origin", "https://evil.example"}, {"Expect", "x"}}),
            "expectation-failed");
}

TEST(ProblemPages, NeedNoTokenAndAreHtmlOrTextAsAskedFor) {
  ServerOptions options;
  options.token = std::make_shared<const windsplat::access::Token>(
      windsplat::access::Token::parse("correct-horse_battery.staple").value());
  const TestServer server(options);
  const Answer denied = get(server.port(), "/v1");
  EXPECT_EQ(slug_with_page(server, "/", json_of(denied)), "unauthorized");
  const Answer html =
      get(server.port(), "/problems/unauthorized", {{"Accept", "text/html,*/*;q=0.8"}});
  EXPECT_THAT(html.header("content-type"), StartsWith("text/html"));
  EXPECT_THAT(html.body, HasSubstr("<h1>unauthorized: 401 Unauthorized</h1>"));
  EXPECT_THAT(html.header("vary"), HasSubstr("Accept"));
  const Answer all = get(server.port(), "/problems");
  EXPECT_EQ(all.status, 200);
  EXPECT_THAT(all.body, HasSubstr("out-of-memory: 507"));
  EXPECT_EQ(get(server.port(), "/problems/none").status, 404);
  EXPECT_EQ(request(server.port(), "POST", "/problems").status, 401);
  EXPECT_EQ(get(server.port(), "/problems/busy/more").status, 401);
}

TEST(ProblemPages, FailedJobsAndErrorsOfAStreamHaveTypesToo) {
  const std::filesystem::path folder = std::filesystem::path(small_file()).parent_path();
  std::ofstream(folder / "broken.nc") << "CDF\x01 and nothing else";
  ServerOptions options;
  options.base_path = "/a/b/";
  options.data_root = folder.string();
  const TestServer server(options);
  const Answer job =
      request(server.port(), "POST", "/a/b/v1/datasets", json_type, R"({"path":"broken.nc"})");
  ASSERT_EQ(job.status, 202) << job.body;
  Json state;
  ASSERT_TRUE(comes_true([&] {
    state = json_of(get(server.port(), job.header("location")));
    return state["state"] == "failed";
  }));
  EXPECT_EQ(slug_with_page(server, "/a/b/", state["problem"]), "unreadable-data");
  const Json list = json_of(get(server.port(), "/a/b/v1/jobs"));
  EXPECT_EQ(list["jobs"].back()["problem"]["type"], state["problem"]["type"]);

  StreamClient viewer(server.port(), {}, "/a/b/v1/stream");
  ASSERT_TRUE(viewer.next_text("hello"));
  viewer.say(R"({"type":"patch","rev":1,"patch":{"dataset":"none"}})");
  const auto error = viewer.next_text("error");
  ASSERT_TRUE(error);
  EXPECT_THAT(slug_with_page(server, "/a/b/", Json::parse(*error)["problem"]),
              testing::AnyOf("not-found", "invalid-value"));
}

}  // namespace
}  // namespace server_test
