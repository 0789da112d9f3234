// Fetched files on disk: the bound, the order of removal, identity, and files that are incomplete.
#include "server/data/fetch/object_cache.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "server/data/files/input_file.hpp"

namespace windsplat::data::fetch {
namespace {

namespace fs = std::filesystem;

class CachedObjects : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "windsplat-cache-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    above_ = name;
    folder_ = above_ / "a/cache";
    cache_ = opened(std::uint64_t{1} << 20);
  }
  void TearDown() override {
    std::error_code ignored;
    fs::remove_all(above_, ignored);
  }

  [[nodiscard]] std::unique_ptr<ObjectCache> opened(std::uint64_t bytes_max) const {
    auto out = ObjectCache::open({folder_.native(), bytes_max});
    EXPECT_TRUE(out) << (out ? "" : out.error().message);
    return out ? std::move(*out) : nullptr;
  }
  void put(const std::string& url, const std::string& text, const std::string& etag = "") {
    auto part = cache_->begin();
    ASSERT_TRUE(part) << part.error().message;
    for (const char c : text.substr(0, 3)) ASSERT_TRUE(part->append(std::string_view(&c, 1)));
    ASSERT_TRUE(part->append(std::string_view(text).substr(std::min<std::size_t>(3, text.size()))));
    ASSERT_TRUE(cache_->keep(url, std::move(*part), {etag, "Tue"}));
  }
  std::string text_of(const std::string& url) {
    auto found = cache_->find(url);
    if (!found) return "none";
    std::string out(1 << 20, '\0');
    out.resize(static_cast<std::size_t>(
        std::max<ssize_t>(0, ::read(found->file.number(), out.data(), out.size()))));
    return out;
  }
  std::string identity_of(const std::string& url) {
    auto found = cache_->find(url);
    return found ? InputFile::adopt(found->file.give(), "x").value()->identity() : "none";
  }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path above_;
  fs::path folder_;
  std::unique_ptr<ObjectCache> cache_;
};

TEST_F(CachedObjects, AFileIsFoundByItsUrlAlsoByTheNextProcess) {
  put("https://h/a", "first", "\"1\"");
  put("https://h/b", "second");
  EXPECT_EQ(text_of("https://h/a"), "first");
  EXPECT_EQ(text_of("https://h/c"), "none");
  EXPECT_TRUE(cache_->find("https://h/a")->is_fresh);
  cache_ = opened(std::uint64_t{1} << 20);
  EXPECT_EQ(text_of("https://h/a"), "first");
  EXPECT_EQ(cache_->find("https://h/a")->validators.etag, "\"1\"");
  EXPECT_EQ(cache_->find("https://h/a")->validators.last_modified, "Tue");
  EXPECT_FALSE(cache_->find("https://h/a")->is_fresh) << "this process did not ask the host";
  cache_->confirm("https://h/a");
  EXPECT_TRUE(cache_->find("https://h/a")->is_fresh);
}

TEST_F(CachedObjects, ANewStateReplacesTheOldOneWhichStaysReadableWhereItIsOpen) {
  put("https://h/a", "old", "\"1\"");
  auto before = cache_->find("https://h/a");
  put("https://h/a", "new state", "\"2\"");
  EXPECT_EQ(text_of("https://h/a"), "new state");
  EXPECT_EQ(files(), 2U) << "one file and its validators";
  std::string text(3, ' ');
  ASSERT_EQ(::pread(before->file.number(), text.data(), 3, 0), 3);
  EXPECT_EQ(text, "old");
  cache_->remove("https://h/a");
  EXPECT_EQ(files(), 0U);
}

TEST_F(CachedObjects, IdentityFollowsTheBytesAndNothingElse) {
  put("https://h/a", "data", "\"1\"");
  const std::string first = identity_of("https://h/a");
  cache_->remove("https://h/a");
  ::usleep(20'000);
  put("https://h/a", "data", "\"2\"");
  EXPECT_EQ(identity_of("https://h/a"), first);
  put("https://h/a", "Data", "\"2\"");
  EXPECT_NE(identity_of("https://h/a"), first);
}

TEST_F(CachedObjects, FilesUsedLeastRecentlyAreRemovedBeyondTheLimit) {
  const std::string text(40'000, 'x');
  cache_ = opened(200'000);  // four of 40000 bytes and their validators
  for (const char* url : {"1", "2", "3", "4"}) {
    put(url, text + url);
    ::usleep(10'000);
  }
  EXPECT_EQ(text_of("1"), text + "1");  // used again
  ::usleep(10'000);
  put("5", text + "5");
  EXPECT_EQ(text_of("2"), "none");
  EXPECT_EQ(text_of("1"), text + "1");
  ::usleep(10'000);
  EXPECT_EQ(text_of("5"), text + "5");
  EXPECT_LE(cache_->bytes(), 200'000U);
  std::uint64_t sum = 0;
  for (const auto& file : fs::directory_iterator(folder_)) sum += file.file_size();
  EXPECT_LE(sum, 200'000U);
  cache_ = opened(60'000);  // a lower limit holds from the start
  EXPECT_EQ(text_of("5"), text + "5");
  EXPECT_EQ(files(), 2U);
}

TEST_F(CachedObjects, AnIncompleteFileIsNeverFound) {
  put("https://h/a", "whole");
  {
    auto part = cache_->begin();
    ASSERT_TRUE(part->append("half of ano"));
    EXPECT_EQ(files(), 3U);
  }
  EXPECT_EQ(files(), 2U) << "removed with its object";
  for (const auto& file : fs::directory_iterator(folder_)) {
    if (file.path().extension() != ".meta") {
      ASSERT_EQ(::truncate(file.path().c_str(), 2), 0);
    }
  }
  EXPECT_EQ(text_of("https://h/a"), "none") << "truncated on disk";
}

TEST_F(CachedObjects, DamagedValidatorsAreAFileThatIsNotThere) {
  put("https://h/a", "whole");
  fs::path meta;
  for (const auto& file : fs::directory_iterator(folder_)) {
    if (file.path().extension() == ".meta") meta = file.path();
  }
  std::string text(4096, '\0');
  std::ifstream in(meta);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  for (const std::string& damaged :
       {std::string(), std::string("x"), text.substr(0, text.size() / 2), text + "more\n",
        std::string("../../secret\n5\n\n\n")}) {
    std::ofstream(meta, std::ios::trunc) << damaged;
    EXPECT_EQ(text_of("https://h/a"), "none") << damaged;
  }
  std::ofstream(meta, std::ios::trunc) << text;
  EXPECT_EQ(text_of("https://h/a"), "whole");
}

TEST_F(CachedObjects, LeftoversOfOtherProcessesAreRemovedAfterADay) {
  const std::string old_part = "part-" + std::string(32, 'a');
  const std::string new_part = "part-" + std::string(32, 'b');
  std::ofstream(folder_ / old_part) << "old";
  std::ofstream(folder_ / new_part) << "new";
  const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(48);
  fs::last_write_time(folder_ / old_part, long_ago);
  cache_ = opened(1 << 20);
  EXPECT_FALSE(fs::exists(folder_ / old_part));
  EXPECT_TRUE(fs::exists(folder_ / new_part));
}

TEST_F(CachedObjects, FilesOfTheUserInTheFolderAreNeitherCountedNorRemoved) {
  const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(48);
  for (const char* name : {"precious.nc", "part-00000", "part-1-1", "notes.meta"}) {
    std::ofstream(folder_ / name) << std::string(100'000, 'x');
    fs::last_write_time(folder_ / name, long_ago);
  }
  cache_ = opened(50'000);
  EXPECT_EQ(cache_->bytes(), 0U);
  for (const char* url : {"1", "2"}) put(url, std::string(30'000, 'y'));
  for (const char* name : {"precious.nc", "part-00000", "part-1-1", "notes.meta"}) {
    EXPECT_TRUE(fs::exists(folder_ / name)) << name;
  }
}

// As of two containers that share the folder, whose processes have the same id.
TEST_F(CachedObjects, TwoCachesOfOneFolderKeepTheirPartsApart) {
  const auto other = opened(1 << 20);
  auto first = cache_->begin();
  auto second = other->begin();
  ASSERT_TRUE(first && second);
  ASSERT_TRUE(first->append("first"));
  ASSERT_TRUE(second->append("other"));
  ASSERT_TRUE(cache_->keep("https://h/1", std::move(*first), {}));
  ASSERT_TRUE(other->keep("https://h/2", std::move(*second), {}));
  EXPECT_EQ(text_of("https://h/1"), "first");
  EXPECT_EQ(text_of("https://h/2"), "other");
}

TEST_F(CachedObjects, AFolderThatOthersMayChangeIsRefused) {
  ASSERT_EQ(::chmod(folder_.c_str(), 0777), 0);
  EXPECT_EQ(ObjectCache::open({folder_.native(), 1 << 20}).error().kind, ErrorKind::invalid);
  std::ofstream(above_ / "file") << "x";
  EXPECT_FALSE(ObjectCache::open({(above_ / "file").native(), 1 << 20}));
}

}  // namespace
}  // namespace windsplat::data::fetch
