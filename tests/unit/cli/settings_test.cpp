// Settings of the daemon: files that must not block, and calls on a separate thread.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <stdexcept>

#include "server/cli/settings_file.hpp"
#include "server/cli/signals.hpp"

namespace windsplat::cli {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
constexpr milliseconds patience{60'000};

class SettingsFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "windsplat-set-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }

  std::filesystem::path folder_;
};

TEST_F(SettingsFile, IsReadWholeUpToItsLimit) {
  std::ofstream(file("text")) << "0123456789";
  EXPECT_EQ(read_settings_file(file("text"), 10).value(), "0123456789");
  const auto large = read_settings_file(file("text"), 9);
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().kind, ErrorKind::too_large);
  std::ofstream(file("empty")).flush();
  EXPECT_EQ(read_settings_file(file("empty"), 9).value(), "");
  EXPECT_EQ(read_settings_file(file("absent"), 9).error().kind, ErrorKind::not_found);
}

// Opening a pipe without a writer would block.
TEST_F(SettingsFile, NonRegularFileDoesNotBlock) {
  ASSERT_EQ(mkfifo(file("pipe").c_str(), 0600), 0);
  for (const std::string& path : {file("pipe"), folder_.string(), std::string("/dev/zero")}) {
    const auto text = read_settings_file(path, 10);
    ASSERT_FALSE(text) << path;
    EXPECT_EQ(text.error().kind, ErrorKind::invalid);
    EXPECT_THAT(text.error().message, HasSubstr("regular file"));
  }
}

// A call that ends on request.
class Gate {
 public:
  void pass() {
    std::unique_lock lock(mutex_);
    ++waiting_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return open_; });
  }
  void open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }
  bool is_reached() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, [this] { return waiting_ > 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int waiting_ = 0;
  bool open_ = false;
};

TEST(Errand, DoesNotBlockRequestersOrShutdown) {
  Gate gate;
  std::atomic<int> calls = 0;
  Errand errand([&] {
    ++calls;
    gate.pass();
  });
  errand.want();
  ASSERT_TRUE(gate.is_reached());
  errand.want();
  EXPECT_FALSE(errand.end(milliseconds(1))) << "it is still running";
  gate.open();
  EXPECT_TRUE(errand.end(patience));
  EXPECT_EQ(calls, 1) << "none starts after the end";
}

TEST(Errand, RunsOnceMoreForMissedRequestsAndSurvivesExceptions) {
  Gate gate;
  std::atomic<int> calls = 0;
  Gate second;
  Errand errand([&] {
    if (++calls == 2) second.pass();
    gate.pass();
    throw std::runtime_error("no memory");
  });
  errand.want();
  ASSERT_TRUE(gate.is_reached());
  for (int n = 0; n < 5; ++n) errand.want();
  gate.open();
  EXPECT_TRUE(second.is_reached());
  second.open();
  EXPECT_TRUE(errand.end(patience));
  EXPECT_EQ(calls, 2);
}

}  // namespace
}  // namespace windsplat::cli
