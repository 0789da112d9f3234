// GET /v1/files: the folders below a data root, as a client sees and opens them.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "tests/integration/server/opening.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class ListedFiles : public testing::Test {
 protected:
  ListedFiles() {
    std::string name = (fs::temp_directory_path() / "windsplat-files-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) return;
    root_ = fs::canonical(name);
    fs::create_directories(root_ / "runs");
    for (const char* file : {"runs/s_1.nc", "runs/s_2.nc", "runs/gcm.nc"}) {
      fs::copy_file(small_file(), root_ / file);
    }
    std::ofstream(root_ / "notes.txt") << "hello";
    server_ = std::make_unique<TestServer>(with_root(root_));
  }
  ~ListedFiles() override {
    std::error_code ignored;
    fs::remove_all(root_, ignored);
  }
  [[nodiscard]] Answer files(const std::string& query = "") const {
    return get(server_->port(), "/v1/files" + query);
  }

  fs::path root_;
  std::unique_ptr<TestServer> server_;
};

TEST_F(ListedFiles, EveryFileOfAKnownFormatOpens) {
  const Json top = json_of(files());
  ASSERT_EQ(top["entries"].size(), 2U);
  EXPECT_EQ(top["entries"][0]["format"], nullptr);
  EXPECT_EQ(top["entries"][1]["kind"], "folder");
  const Json runs = json_of(files("?folder=runs"));
  ASSERT_EQ(runs["entries"].size(), 3U);
  for (const Json& entry : runs["entries"]) {
    const std::string path = "runs/" + entry["name"].get<std::string>();
    EXPECT_FALSE(entry["format"].is_null()) << path;
    EXPECT_EQ(finished_job(server_->port(), post_file(server_->port(), path))["state"], "done");
  }
  EXPECT_EQ(runs["groups"], Json::parse(R"([{"pattern": "s_*.nc", "files": 2}])"));
}

TEST_F(ListedFiles, PagesAreLimited) {
  const Json page = json_of(files("?folder=runs&limit=2"));
  EXPECT_EQ(page["entries"].size(), 2U);
  EXPECT_EQ(page["next"], "s_1.nc");
  EXPECT_EQ(json_of(files("?folder=runs&limit=2&after=s_1.nc"))["entries"].size(), 1U);
  for (const char* query : {"?limit=0", "?limit=501"}) EXPECT_EQ(files(query).status, 422) << query;
  for (const char* query : {"?limit=x", "?path=runs"}) EXPECT_EQ(files(query).status, 400) << query;
}

TEST_F(ListedFiles, FoldersOutsideTheRootAreRefusedWithoutNamingIt) {
  fs::create_symlink("/etc", root_ / "etc");
  for (const char* query :
       {"?folder=..", "?folder=runs/../..", "?folder=/etc", "?folder=etc", "?folder=%2e%2e"}) {
    const Answer answer = files(query);
    EXPECT_EQ(answer.status, 422) << query;
    EXPECT_THAT(answer.body, Not(HasSubstr(root_.native())));
  }
  EXPECT_EQ(files("?folder=nothing").status, 404);
}

TEST(FilesWithoutARoot, AreNone) {
  TestServer server;
  const Answer answer = get(server.port(), "/v1/files");
  EXPECT_EQ(answer.status, 204);
  EXPECT_EQ(answer.body, "");
}

}  // namespace
}  // namespace server_test
