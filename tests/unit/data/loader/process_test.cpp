// The process of a loader: whatever happens to it is an error of the call, and it leaves nothing
// behind.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "server/data/loader/loader.hpp"
#include "tests/unit/data/loader/loader_fixture.hpp"
#include "tests/unit/data/loader_files.hpp"

namespace windsplat::data::loader {
namespace {

using std::chrono::milliseconds;

TEST_F(Loader, CrashIsAnErrorAndTheNextReadStartsAnother) {
  const std::string path = folder_ / "a.nc";
  test::write_wind(path, NC_NETCDF4);
  const auto source = opened(path);
  ASSERT_TRUE(source);
  const auto first = source->read(0, 1);
  ASSERT_TRUE(first);
  const pid_t id = source->process();
  ASSERT_GT(id, 0);
  ASSERT_EQ(::kill(id, SIGSTOP), 0);  // so that it is killed during the read
  std::thread killer([id] {
    std::this_thread::sleep_for(milliseconds(100));
    ::kill(id, SIGKILL);
  });
  const auto broken = source->read(0, 1);
  killer.join();
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().kind, ErrorKind::bad_data);
  EXPECT_EQ(broken.error().message,
            "the loader of 'a.nc' was terminated by signal 9 while reading 'wind'");
  EXPECT_EQ(source->process(), -1);
  const auto again = source->read(0, 1);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_NE(source->process(), id);
  expect_same(*first, *again);
}

TEST_F(Loader, CrashWhileIdleIsReplacedSilently) {
  const std::string path = folder_ / "a.nc";
  test::write_wind(path, 0);
  const auto source = opened(path);
  ASSERT_TRUE(source);
  const pid_t id = source->process();
  ::kill(id, SIGKILL);
  siginfo_t about{};
  ASSERT_EQ(::waitid(P_PID, static_cast<id_t>(id), &about, WEXITED | WNOWAIT), 0);
  const auto read = source->read(0, 0);
  EXPECT_TRUE(read) << read.error().message;
}

TEST_F(Loader, TimeoutEndsIt) {
  const std::string path = folder_ / "a.nc";
  test::write_wind(path, NC_NETCDF4);
  Limits limits;
  limits.read_time = milliseconds(200);
  const auto source = opened(path, limits);
  ASSERT_TRUE(source);
  const pid_t id = source->process();
  ::kill(id, SIGSTOP);
  const auto late = source->read(0, 0);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().kind, ErrorKind::bad_data);
  EXPECT_EQ(late.error().message,
            "the loader of 'a.nc' was terminated after 0.2 s while reading 'wind'");
  EXPECT_EQ(::kill(id, 0), -1);
  const auto again = source->read(0, 0);
  EXPECT_TRUE(again) << again.error().message;
}

TEST_F(Loader, StoppedLoaderIsEndedWhileOthersAreRead) {
  const std::string path = folder_ / "a.nc";
  const std::string other_path = folder_ / "b.nc";
  test::write_wind(path, NC_NETCDF4);
  test::write_wind(other_path, NC_NETCDF4);
  Limits limits;
  limits.stall_time = std::chrono::seconds(3);
  const auto source = opened(path, limits);
  const auto other = opened(other_path, Limits());
  ASSERT_TRUE(source && other);
  const pid_t id = source->process();
  ASSERT_EQ(::kill(id, SIGSTOP), 0);
  std::atomic<bool> over{false};
  std::thread reader([&] {
    const auto stopped = source->read(0, 0);
    over = true;
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().kind, ErrorKind::bad_data);
    EXPECT_EQ(
        stopped.error().message,
        "the loader of 'a.nc' made no progress for 3.0 s and was terminated while reading 'wind'");
  });
  EXPECT_TRUE(other->read(0, 0));
  EXPECT_FALSE(over) << "the other one is read while this one hangs";
  reader.join();
  EXPECT_EQ(::kill(id, 0), -1) << "it has ended";
  const auto again = source->read(0, 0);
  EXPECT_TRUE(again) << again.error().message;
  EXPECT_NE(source->process(), id);
}

TEST_F(Loader, ReadCanBeCancelledFromAnotherThread) {
  const std::string path = folder_ / "a.nc";
  test::write_wind(path, NC_NETCDF4);
  const auto source = opened(path);
  ASSERT_TRUE(source);
  source->cancel();  // of no data
  ASSERT_TRUE(source->read(0, 0));
  const pid_t id = source->process();
  ::kill(id, SIGSTOP);
  std::thread other([&] {
    std::this_thread::sleep_for(milliseconds(100));
    source->cancel();
  });
  const auto read = source->read(0, 0);
  other.join();
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, ErrorKind::cancelled);
  EXPECT_TRUE(source->read(0, 0));
}

TEST_F(Loader, ReleasedLoaderHoldsNothingAndReopensTheSameFileOnly) {
  const std::string path = folder_ / "a.nc";
  test::write_wind(path, NC_NETCDF4);
  const auto source = opened(path);
  ASSERT_TRUE(source);
  const auto before = source->read(0, 0);
  const pid_t id = source->process();
  source->release();
  EXPECT_EQ(source->process(), -1);
  EXPECT_EQ(::kill(id, 0), -1);
  const auto after = source->read(0, 0);
  ASSERT_TRUE(before && after);
  expect_same(*before, *after);
  source->release();
  test::write_wind(folder_ / "b.nc", 0);
  std::filesystem::rename(folder_ / "b.nc", path);
  const auto changed = source->read(0, 0);
  ASSERT_FALSE(changed);
  EXPECT_EQ(changed.error().kind, ErrorKind::bad_data);
  EXPECT_EQ(changed.error().message, "'a.nc' has changed since it was opened; open it again");
}

std::size_t open_descriptors() {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    ++count;
  }
  return count;
}

TEST_F(Loader, TwoHundredLoadersLeaveNothingBehind) {
  const std::string path = folder_ / "a.nc";
  const std::string text = folder_ / "text.nc";
  test::write_wind(path, 0);
  std::ofstream(text) << "none";
  ASSERT_FALSE(open_path(text));  // the first one opens the null device for all
  const std::size_t before = open_descriptors();
  for (int i = 0; i < 100; ++i) {
    const auto source = opened(path);
    ASSERT_TRUE(source);
    const auto volume = source->read(0, 0);
    ASSERT_TRUE(volume);
    if (i % 4 == 0) source->release();
    if (i % 4 == 1) ::kill(source->process(), SIGKILL);
    ASSERT_FALSE(open_path(text));
  }
  EXPECT_EQ(open_descriptors(), before);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

TEST_F(Loader, NoneOutlivesTheDaemonEvenWhileBusy) {
  const std::string path = folder_ / "a.nc";
  test::write_wind(path, 0);
  ASSERT_EQ(::prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0), 0);  // orphans become children of this
                                                              // process
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  const pid_t daemon = ::fork();
  if (daemon == 0) {
    const auto source = opened(path);
    const pid_t id = source ? source->process() : -1;
    if (::write(ends[1], &id, sizeof id) != sizeof id) ::_exit(1);
    ::pause();
  }
  pid_t id = -1;
  ASSERT_EQ(::read(ends[0], &id, sizeof id), static_cast<ssize_t>(sizeof id));
  ::close(ends[0]);
  ::close(ends[1]);
  ASSERT_GT(id, 0);
  ::kill(id, SIGSTOP);  // it cannot read from its socket
  ::kill(daemon, SIGKILL);
  ASSERT_EQ(::waitpid(daemon, nullptr, 0), daemon);
  ::kill(id, SIGCONT);
  int status = 0;
  ASSERT_EQ(::waitpid(id, &status, 0), id);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGIO);
  ::prctl(PR_SET_CHILD_SUBREAPER, 0, 0, 0, 0);
}

TEST_F(Loader, StartsOnlyTheNamedProgram) {
  const std::string path = folder_ / "a.nc";
  test::write_wind(path, 0);
  set_program("");
  const auto unnamed = open_path(path);
  ASSERT_FALSE(unnamed);
  EXPECT_EQ(unnamed.error().kind, ErrorKind::internal);
  set_program(folder_ / "absent");
  const auto absent = open_path(path);
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().kind, ErrorKind::internal);
}

}  // namespace
}  // namespace windsplat::data::loader
