// Saved views over REST: from POST to DELETE, conditional changes, and refusals.
#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "protocol/saved_view.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using windsplat::views::SavedViews;

Headers with(Headers headers, const std::string& name, const std::string& value) {
  headers.emplace_back(name, value);
  return headers;
}

void expect_views_problem(const Answer& answer, int status, const std::string& pointer = "") {
  EXPECT_EQ(answer.status, status) << answer.body;
  EXPECT_EQ(answer.header("content-type"), "application/problem+json");
  const Json problem = json_of(answer);
  EXPECT_EQ(problem.value("status", 0), status) << answer.body;
  EXPECT_FALSE(problem.value("detail", "").empty());
  if (!pointer.empty()) {
    ASSERT_TRUE(problem.contains("errors")) << answer.body;
    EXPECT_EQ(problem["errors"][0].value("pointer", ""), pointer);
  }
}

class Views : public testing::Test {
 protected:
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  Answer post(const std::string& body, const Headers& headers = json_type) {
    return request(port(), "POST", "/v1/views", headers, body);
  }
  Answer ask(const std::string& method, const std::string& id, const std::string& body,
             const Headers& headers = json_type) {
    return request(port(), method, "/v1/views/" + id, headers, body);
  }
  Answer read(const std::string& id, const Headers& headers = {}) {
    return get(port(), "/v1/views/" + id, headers);
  }
  std::string saved(const std::string& view) {
    const Answer answer = post(view);
    EXPECT_EQ(answer.status, 201) << answer.body;
    return json_of(answer).value("id", "");
  }

  TestServer server_;
};

TEST_F(Views, PostedViewIsStoredInCanonicalFormAtItsLocation) {
  // The dataset does not exist on the server.
  const Answer made = post(R"({ "step": 3.0, "dataset": "elsewhere", "vector": {"field": null},
                                "camera": {}, "quality": {"maxError": null} })");
  ASSERT_EQ(made.status, 201) << made.body;
  const Json told = json_of(made);
  EXPECT_TRUE(windsplat::protocol::is_view_id(told["id"].get<std::string>()));
  EXPECT_EQ(made.header("location"), "/v1/views/" + told["id"].get<std::string>());
  EXPECT_EQ(told["kept"], "memory");
  EXPECT_THAT(made.body,
              HasSubstr(R"("view":{"dataset":"elsewhere","step":3,"vector":{"field":null}})"));
  const Answer read_back = get(port(), made.header("location"));
  EXPECT_EQ(read_back.status, 200);
  EXPECT_EQ(read_back.body, made.body);
  EXPECT_EQ(read_back.header("content-type"), "application/json");
  EXPECT_EQ(read_back.header("etag"), made.header("etag"));
  EXPECT_NE(saved("{}"), saved("{}"));
}

TEST_F(Views, LocationContainsTheBasePath) {
  windsplat::api::ServerOptions options;
  options.base_path = "/a/b/";
  const TestServer below(options);
  const Answer made = request(below.port(), "POST", "/a/b/v1/views", json_type, "{}");
  ASSERT_EQ(made.status, 201);
  EXPECT_THAT(made.header("location"), testing::StartsWith("/a/b/v1/views/"));
  EXPECT_EQ(get(below.port(), made.header("location")).status, 200);
}

TEST_F(Views, EtagIdentifiesTheCurrentView) {
  const std::string id = saved(R"({"step":1})");
  const std::string first = read(id).header("etag");
  ASSERT_FALSE(first.empty());
  EXPECT_EQ(read(id, {{"If-None-Match", first}}).status, 304);
  EXPECT_EQ(read(id, {{"If-None-Match", first}}).body, "");
  const Answer changed = ask("PUT", id, R"({"step":2})");
  EXPECT_EQ(changed.status, 200) << changed.body;
  EXPECT_NE(changed.header("etag"), first);
  EXPECT_EQ(read(id, {{"If-None-Match", first}}).status, 200);
  EXPECT_EQ(read(id).header("etag"), changed.header("etag"));
  EXPECT_NE(read(saved(R"({"step":2})")).header("etag"), changed.header("etag")) << "another's";
  EXPECT_EQ(ask("PUT", id, R"({"step":1})").header("etag"), first) << "unchanged";
}

TEST_F(Views, PutReplacesAndPatchMerges) {
  const std::string id = saved(R"({"step":1,"image":{"width":320,"height":200}})");
  const Json created = json_of(read(id))["created"];
  const Answer patched =
      ask("PATCH", id, R"({"image":{"width":640},"vector":{"field":null},"step":null})",
          {{"Content-Type", "application/merge-patch+json"}});
  EXPECT_EQ(patched.status, 200) << patched.body;
  EXPECT_EQ(json_of(patched)["view"],
            Json::parse(R"({"image":{"width":640,"height":200},"vector":{"field":null}})"));
  EXPECT_EQ(read(id).body, patched.body);
  EXPECT_EQ(json_of(ask("PATCH", id, R"({"step":2})"))["view"]["step"], 2);
  const Answer put = ask("PUT", id, R"({"dataset":"small"})");
  EXPECT_EQ(put.status, 200) << put.body;
  EXPECT_EQ(json_of(put)["view"], Json({{"dataset", "small"}}));
  EXPECT_EQ(json_of(read(id))["view"], Json({{"dataset", "small"}}));
  EXPECT_EQ(json_of(put)["created"], created);
  EXPECT_EQ(json_of(put)["id"], id);
}

TEST_F(Views, DeletedViewReturns404) {
  const std::string id = saved("{}");
  const std::string other = saved("{}");
  const Answer gone = ask("DELETE", id, "", {});
  EXPECT_EQ(gone.status, 204);
  EXPECT_EQ(gone.body, "");
  expect_views_problem(read(id), 404);
  expect_views_problem(ask("DELETE", id, "", {}), 404);
  expect_views_problem(ask("PUT", id, "{}"), 404);
  expect_views_problem(ask("PATCH", id, "{}"), 404);
  EXPECT_EQ(read(other).status, 200);
}

TEST_F(Views, IfNoneMatchOnAnExistingViewChangesNothing) {
  const std::string id = saved(R"({"step":1})");
  for (const std::string& tag : {std::string("*"), read(id).header("etag")}) {
    expect_views_problem(ask("PUT", id, R"({"step":2})", with(json_type, "If-None-Match", tag)),
                         412);
    expect_views_problem(ask("DELETE", id, "", {{"If-None-Match", tag}}), 412);
  }
  EXPECT_EQ(json_of(read(id))["view"]["step"], 1);
  EXPECT_EQ(ask("PUT", id, R"({"step":2})", with(json_type, "If-None-Match", "\"x\"")).status, 200);
}

TEST_F(Views, IfMatchRefusesChangesToAnotherVersion) {
  const std::string id = saved(R"({"step":1})");
  const std::string seen = read(id).header("etag");
  const auto if_match = [](const std::string& tag) { return with(json_type, "If-Match", tag); };
  EXPECT_EQ(ask("PUT", id, R"({"step":2})", if_match(seen)).status, 200);
  for (const std::string& stale :
       {seen, std::string("\"other\""), "W/" + read(id).header("etag")}) {
    expect_views_problem(ask("PUT", id, R"({"step":3})", if_match(stale)), 412);
    expect_views_problem(ask("PATCH", id, R"({"step":3})", if_match(stale)), 412);
    expect_views_problem(ask("DELETE", id, "", {{"If-Match", stale}}), 412);
  }
  EXPECT_EQ(json_of(read(id))["view"]["step"], 2);
  EXPECT_EQ(ask("PATCH", id, R"({"step":4})", if_match("\"x\", " + read(id).header("etag"))).status,
            200);
  EXPECT_EQ(ask("PATCH", id, R"({"step":5})", if_match("*")).status, 200);
  EXPECT_EQ(json_of(read(id))["view"]["step"], 5);
  EXPECT_EQ(ask("DELETE", id, "", {{"If-Match", read(id).header("etag")}}).status, 204);
  expect_views_problem(ask("DELETE", id, "", {{"If-Match", "*"}}), 404);
}

// Each client modifies what it read and retries on a conflict: no change is lost.
TEST_F(Views, ConcurrentWritersWithIfMatchLoseNoChange) {
  const std::string id = saved(R"({"step":0})");
  constexpr int writers = 4;
  constexpr int changes = 10;
  std::vector<std::thread> threads;
  for (int w = 0; w < writers; ++w) {
    threads.emplace_back([this, id] {
      for (int done = 0; done < changes;) {
        const Answer seen = read(id);
        const int step = json_of(seen)["view"]["step"].get<int>();
        const Answer changed = ask("PATCH", id, Json{{"step", step + 1}}.dump(),
                                   with(json_type, "If-Match", seen.header("etag")));
        if (changed.status == 200) ++done;
        if (changed.status != 200 && changed.status != 412) {
          ADD_FAILURE() << changed.status << changed.body;
          return;
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(json_of(read(id))["view"]["step"], writers * changes);
}

TEST_F(Views, ErrorsNameTheirPointerAndChangeNothing) {
  const std::string id = saved(R"({"step":1})");
  const Headers patch_type{{"Content-Type", "application/merge-patch+json"}};
  expect_views_problem(post(R"({"image":{"width":0}})"), 422, "/image/width");
  expect_views_problem(post(R"({"colour":1})"), 422, "/colour");
  expect_views_problem(post("{"), 400);
  expect_views_problem(post("[]"), 422);
  expect_views_problem(ask("PUT", id, R"({"step":-1})"), 422, "/step");
  expect_views_problem(ask("PUT", id, "not JSON"), 400);
  expect_views_problem(ask("PATCH", id, R"({"camera":{"fovY":180}})", patch_type), 422,
                       "/camera/fovY");
  expect_views_problem(ask("PATCH", id, "{", patch_type), 400);
  expect_views_problem(post("{}", {}), 415);
  expect_views_problem(post("{}", {{"Content-Type", "text/plain"}}), 415);
  expect_views_problem(ask("PUT", id, "{}", patch_type), 415);
  const Answer refused = ask("PATCH", id, "{}", {{"Content-Type", "text/plain"}});
  expect_views_problem(refused, 415);
  EXPECT_THAT(refused.header("accept-patch"), HasSubstr("application/merge-patch+json"));
  const std::string long_body = "{" + std::string(70'000, ' ') + "}";
  for (const char* method : {"PUT", "PATCH"}) expect_views_problem(ask(method, id, long_body), 413);
  expect_views_problem(post(long_body), 413);
  expect_views_problem(get(port(), "/v1/views/" + id + "?step=1"), 400);
  EXPECT_EQ(json_of(read(id))["view"], Json({{"step", 1}}));
}

TEST_F(Views, BodyNeedsItsLength) {
  for (const std::string method : {"POST", "PUT", "PATCH"}) {
    EXPECT_EQ(raw(port(), method + " /v1/views HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 411);
  }
}

TEST_F(Views, UnsupportedMethodsGetTheAllowedOnes) {
  const std::string id = saved("{}");
  const Answer list = get(port(), "/v1/views");
  expect_views_problem(list, 405);
  EXPECT_EQ(list.header("allow"), "POST, OPTIONS");
  for (const char* method : {"PUT", "PATCH", "DELETE"}) {
    expect_views_problem(request(port(), method, "/v1/views", json_type, "{}"), 405);
  }
  const Answer posted = ask("POST", id, "{}");
  expect_views_problem(posted, 405);
  EXPECT_EQ(posted.header("allow"), "GET, HEAD, PUT, PATCH, DELETE, OPTIONS");
  const Answer options = request(port(), "OPTIONS", "/v1/views/" + id);
  EXPECT_EQ(options.status, 204);
  EXPECT_EQ(options.header("allow"), posted.header("allow"));
  Socket socket(port());
  socket.send("HEAD /v1/views/" + id + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const Answer head = read_answer(socket, true);
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.header("etag"), read(id).header("etag"));
  EXPECT_EQ(head.header("content-length"), std::to_string(read(id).body.size()));
}

TEST_F(Views, OnlyAnIdNamesAView) {
  saved("{}");
  for (const char* path : {"x", "0123456789", "..%2f..%2fetc%2fpasswd", "%2e%2e", "a%00b", "a/b"}) {
    const int status = get(port(), std::string("/v1/views/") + path).status;
    EXPECT_TRUE(status == 404 || status == 400) << path << ' ' << status;
  }
}

// --- limits and disk ----------------------------------------------------------------------------

class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "windsplat-state-XXXXXX").string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    path = name;
  }
  ~Folder() { fs::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  fs::path path;
};

windsplat::api::ServerOptions keeping(const windsplat::views::Options& options) {
  windsplat::api::ServerOptions out;
  auto views = SavedViews::open(options);
  EXPECT_TRUE(views) << (views ? "" : views.error().message);
  if (views) out.views = std::move(*views);
  return out;
}

TEST(ViewsOfAServer, FullStoreRefusesAndKeepsItsViews) {
  const TestServer server(keeping({{}, 2}));
  const auto post = [&] { return request(server.port(), "POST", "/v1/views", json_type, "{}"); };
  const std::string first = post().header("location");
  const std::string second = post().header("location");
  const Answer refused = post();
  expect_views_problem(refused, 507);
  EXPECT_THAT(refused.body, HasSubstr("2 views"));
  EXPECT_EQ(get(server.port(), first).status, 200);
  EXPECT_EQ(get(server.port(), second).status, 200);
  EXPECT_EQ(request(server.port(), "DELETE", first).status, 204);
  EXPECT_EQ(post().status, 201);
}

TEST(ViewsOfAServer, WithAStateFolderTheySurviveARestart) {
  const Folder folder;
  std::string location;
  std::string body;
  {
    const TestServer server(keeping({folder.path}));
    const Answer made =
        request(server.port(), "POST", "/v1/views", json_type, R"({"dataset":"small","step":2})");
    EXPECT_EQ(json_of(made)["kept"], "disk");
    location = made.header("location");
    body = made.body;
  }
  const TestServer server(keeping({folder.path}));
  const Answer again = get(server.port(), location);
  EXPECT_EQ(again.status, 200);
  EXPECT_EQ(again.body, body);
  EXPECT_EQ(request(server.port(), "DELETE", location).status, 204);
  EXPECT_TRUE(fs::is_empty(folder.path / "views"));
}

// A saved view is valid for POST /v1/frames and yields the same picture.
TEST(ViewsOfAServer, SavedViewRendersTheSamePicture) {
  const TestServer server;
  const std::string view = R"({"step":1,"dataset":"small","image":{"height":48,"width":64}})";
  const Answer made = request(server.port(), "POST", "/v1/views", json_type, view);
  const Headers png{{"Accept", "image/png"}};
  const Answer direct = post_view(server.port(), view, png);
  const Answer kept = post_view(server.port(), json_of(made)["view"].dump(), png);
  ASSERT_EQ(direct.status, 200) << direct.body;
  EXPECT_EQ(direct.body, kept.body);
}

// A page that saves a few views at once is within the limit.
TEST(ViewChanges, AtMostTwentyWaitForASlowDisk) {
  windsplat::api::ServerOptions options;
  const auto views = SavedViews::open({}).value();
  options.views = views;
  TestServer server(std::move(options));
  const std::string id = views->add(windsplat::protocol::ViewDocument::parse("{}").value(), "")->id;
  // Other changes of views wait for this one.
  std::promise<void> begun;
  std::promise<void> let_go;
  std::thread slow([&] {
    const auto waits = [&](const windsplat::protocol::SavedView&) {
      begun.set_value();
      let_go.get_future().wait();
      return false;
    };
    EXPECT_TRUE(views->replace(id, waits, [](const auto& now) { return now; }));
  });
  begun.get_future().wait();
  std::vector<std::future<Answer>> answers;
  for (int i = 0; i < 20; ++i) {
    answers.push_back(std::async(std::launch::async, [&server] {
      return request(server.port(), "POST", "/v1/views", json_type, "{}");
    }));
  }
  std::this_thread::sleep_for(
      std::chrono::milliseconds(300));  // refusals would have arrived by now
  let_go.set_value();
  slow.join();
  for (auto& answer : answers) EXPECT_EQ(answer.get().status, 201);
}

}  // namespace
}  // namespace server_test
