// Files are written completely or not at all, and special files are never replaced.
#include "server/base/whole_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <string>

#include "tests/unit/disk.hpp"

namespace windsplat {
namespace {

namespace fs = std::filesystem;

class WholeFile : public testing::Test {
 protected:
  static std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  [[nodiscard]] std::ptrdiff_t entries() const {
    return std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator());
  }

  test::Folder folder_;
};

TEST_F(WholeFile, IsCreatedAndReplacedWithoutTemporaryFiles) {
  const fs::path path = folder_ / "a.png";
  ASSERT_TRUE(write_whole_file(path, "first"));
  EXPECT_EQ(read(path), "first");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  ASSERT_TRUE(write_whole_file(path, std::string("se\0cond", 7)));
  EXPECT_EQ(read(path), std::string("se\0cond", 7));
  EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(entries(), 1);
}

TEST_F(WholeFile, SyncedWriteHasTheSameResult) {
  const fs::path path = folder_ / "a.json";
  ASSERT_TRUE(write_whole_file(path, "first", Sync::now));
  ASSERT_TRUE(write_whole_file(path, "second", Sync::now));
  EXPECT_EQ(read(path), "second");
  EXPECT_EQ(entries(), 1);
  EXPECT_TRUE(sync_folder(folder_.path()));
  EXPECT_FALSE(sync_folder(path)) << "is no folder";
}

TEST_F(WholeFile, ReaderOfTheOldFileKeepsIt) {
  const fs::path path = folder_ / "a.png";
  ASSERT_TRUE(write_whole_file(path, "the old one"));
  std::ifstream reader(path, std::ios::binary);
  ASSERT_TRUE(write_whole_file(path, "new"));
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(reader), {}), "the old one");
}

TEST_F(WholeFile, FailureKeepsTheOldFileAndLeavesNoPart) {
  const fs::path path = folder_ / "a.png";
  ASSERT_TRUE(write_whole_file(path, "good"));
  Result<void> written;
  {
    const test::FullDisk disk(10);
    written = write_whole_file(path, std::string(1000, 'x'));
  }
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::out_of_memory);
  EXPECT_NE(written.error().message.find("a.png"), std::string::npos);
  EXPECT_EQ(read(path), "good");
  EXPECT_EQ(entries(), 1);
}

TEST_F(WholeFile, LinkTargetIsWritten) {
  const fs::path path = folder_ / "a.png";
  const fs::path link = folder_ / "link.png";
  ASSERT_TRUE(write_whole_file(path, "old"));
  fs::create_symlink("a.png", link);
  ASSERT_TRUE(write_whole_file(link, "new"));
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(read(path), "new");
}

TEST_F(WholeFile, MissingLinkTargetIsCreated) {
  fs::create_directory(folder_ / "sub");
  const fs::path link = folder_ / "link.png";
  fs::create_symlink("sub/second.png", link);
  fs::create_symlink("../a.png", folder_ / "sub" / "second.png");
  ASSERT_TRUE(write_whole_file(link, "new"));
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_TRUE(fs::is_symlink(folder_ / "sub" / "second.png"));
  EXPECT_EQ(read(folder_ / "a.png"), "new");
  EXPECT_EQ(entries(), 3) << "no part is left";
  fs::create_symlink("round.png", folder_ / "round.png");
  EXPECT_FALSE(write_whole_file(folder_ / "round.png", "new"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "round.png"));
}

// Like /dev/stdout redirected to a file: others write to it before and after.
TEST_F(WholeFile, DescriptorPathIsWrittenAtItsPosition) {
  const fs::path path = folder_ / "log";
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  ASSERT_GE(file, 0);
  ASSERT_EQ(::write(file, "before ", 7), 7);
  const std::string name = std::to_string(file);
  fs::create_symlink("/dev/fd/" + name, folder_ / "link");
  EXPECT_TRUE(write_whole_file("/proc/self/fd/" + name, "one "));
  EXPECT_TRUE(write_whole_file(folder_ / "link", "two "));
  ASSERT_EQ(::write(file, "after", 5), 5);
  ::close(file);
  EXPECT_EQ(read(path), "before one two after");
  EXPECT_TRUE(is_stream(folder_ / "link"));
  EXPECT_TRUE(is_stream("/dev/stdout"));
  EXPECT_TRUE(is_stream("/dev/null"));
  EXPECT_FALSE(is_stream(path));
  EXPECT_FALSE(is_stream(folder_.path()));
}

TEST_F(WholeFile, NonRegularFileIsWrittenAndKept) {
  const fs::path pipe = folder_ / "pipe.png";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(reader, 0);
  ASSERT_TRUE(write_whole_file(pipe, "bytes"));
  std::string got(16, '\0');
  EXPECT_EQ(::read(reader, got.data(), got.size()), 5);
  EXPECT_EQ(got.substr(0, 5), "bytes");
  ::close(reader);
  EXPECT_TRUE(fs::is_fifo(pipe));

  const fs::path full = folder_ / "full.png";  // every write to /dev/full fails
  fs::create_symlink("/dev/full", full);
  const auto refused = write_whole_file(full, "bytes");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::out_of_memory) << "the disk is full";
  EXPECT_TRUE(fs::is_symlink(full));

  const fs::path folder = folder_ / "folder.png";
  fs::create_directory(folder);
  EXPECT_FALSE(write_whole_file(folder, "bytes"));
  EXPECT_TRUE(fs::is_directory(folder));
  EXPECT_FALSE(write_whole_file(folder_ / "no" / "a.png", "bytes"));
}

}  // namespace
}  // namespace windsplat
