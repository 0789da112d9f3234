// The documents of the API as the server sends them.
#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "server/access/auth.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using testing::HasSubstr;

// Every row of the table, and nothing else.
TEST(ApiDocuments, HaveTheRoutesOfTheTable) {
  TestServer server;
  std::ifstream file(std::string(WINDSPLAT_SOURCE_DIR) + "/server/api/routes.cpp");
  std::stringstream source;
  source << file.rdbuf();
  const std::string text = source.str();
  const std::regex row(R"re(Route\{"([A-Z]+)",\s*(?:"([^"]+)"|route_stream))re");
  std::set<std::string> rows;
  for (auto at = std::sregex_iterator(text.begin(), text.end(), row); at != std::sregex_iterator();
       ++at) {
    rows.insert((*at)[1].str() + " " + ((*at)[2].matched ? (*at)[2].str() : "/v1/stream"));
  }
  EXPECT_GT(rows.size(), 30U);
  std::set<std::string> described;
  const Json document = json_of(get(server.port(), "/v1/openapi.json"));
  for (const auto& [path, methods] : document["paths"].items()) {
    for (const auto& [method, operation] : methods.items()) {
      std::string name = method;
      std::transform(name.begin(), name.end(), name.begin(), ::toupper);
      EXPECT_TRUE(described.insert(name + " " + path).second);
    }
  }
  EXPECT_EQ(described, rows);
}

TEST(ApiDocuments, AreLinkedAndTheirPagesHaveAPolicy) {
  TestServer server;
  for (const char* from : {"/v1", "/"}) {
    const std::string links = get(server.port(), from).header("link");
    EXPECT_THAT(links, HasSubstr("</v1/openapi.json>; rel=\"service-desc\"")) << from;
    EXPECT_THAT(links, HasSubstr("</v1/asyncapi.html>; rel=\"service-doc\"")) << from;
  }
  EXPECT_EQ(json_of(get(server.port(), "/v1/asyncapi.json"))["asyncapi"], "3.0.0");
  for (const char* path : {"/v1/openapi.html", "/v1/asyncapi.html"}) {
    const Answer page = get(server.port(), path);
    EXPECT_EQ(page.status, 200);
    EXPECT_EQ(page.header("content-type"), "text/html; charset=utf-8");
    EXPECT_THAT(page.header("content-security-policy"),
                testing::StartsWith("default-src 'none'; style-src 'sha256-"));
    EXPECT_EQ(get(server.port(), path, {{"If-None-Match", page.header("etag")}}).status, 304);
  }
}

// What the document says of the token is what the server asks for.
TEST(ApiDocuments, NameTheOperationsThatNeedNoToken) {
  windsplat::api::ServerOptions options;
  options.token = std::make_shared<const windsplat::access::Token>(
      windsplat::access::Token::parse("correct-horse_battery.staple").value());
  const TestServer server(std::move(options));
  const Headers bearer{{"Authorization", "Bearer correct-horse_battery.staple"}};
  const Json document = json_of(get(server.port(), "/v1/openapi.json", bearer));
  int open = 0;
  for (const auto& [path, methods] : document["paths"].items()) {
    if (!methods.contains("get")) continue;
    const Json& operation = methods["get"];
    const bool needs_none = operation.contains("security") && operation["security"].empty();
    EXPECT_NE(operation["responses"].contains("401"), needs_none) << path;
    const std::string target = std::regex_replace(path, std::regex("\\{[^}]*\\}"), "x");
    EXPECT_EQ(get(server.port(), target).status != 401, needs_none) << path;
    open += needs_none ? 1 : 0;
  }
  EXPECT_EQ(open, 4) << "health and problem types";
}

}  // namespace
}  // namespace server_test
