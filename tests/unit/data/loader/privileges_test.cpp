// Capabilities of a running loader as reported by the kernel: none, whichever user started it.
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "server/data/loader/loader.hpp"
#include "tests/unit/data/loader_files.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::loader {
namespace {

// The /proc/PID/status lines with these prefixes, for the children of this process: name and value.
std::vector<std::string> of_children(const std::string& begin) {
  std::vector<std::string> out;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream status(entry.path() / "status");
    bool is_child = false;
    for (std::string line; std::getline(status, line);) {
      if (line == "PPid:\t" + std::to_string(::getpid())) is_child = true;
      if (is_child && line.starts_with(begin)) out.push_back(line);
    }
  }
  return out;
}

TEST(LoaderPrivileges, LoaderHasNoCapabilities) {
  const test::Folder folder;
  const std::string path = folder / "a.nc";
  test::write_wind(path, NC_NETCDF4);
  set_program(WINDSPLAT_PROGRAM);
  const auto source = open(locate(path).value());
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ(of_children("NoNewPrivs"), std::vector<std::string>{"NoNewPrivs:\t1"});
  if (::geteuid() != 0) GTEST_SKIP() << "a user who is not root has no capabilities to drop";
  for (const char* set : {"CapInh", "CapPrm", "CapEff", "CapAmb", "CapBnd"}) {
    EXPECT_EQ(of_children(set), std::vector<std::string>{set + std::string(":\t0000000000000000")});
  }
}

// A separate process for its mounts. Exit code: 0, 1 if a step failed, 2 if the system does not
// permit it.
int read_without_devices(const std::string& path) {
  const int spaces = ::geteuid() == 0 ? CLONE_NEWNS : CLONE_NEWNS | CLONE_NEWUSER;
  if (::unshare(spaces) != 0 || ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) {
    return 2;
  }
  const auto source = open(locate(path).value());
  if (!source) return 1;
  (*source)->release();
  if (::mount("none", "/dev", "tmpfs", 0, nullptr) != 0) return 2;
  if (const auto volume = (*source)->read(0, 0); !volume) {
    ADD_FAILURE() << volume.error().message;
    return 1;
  }
  return 0;
}

TEST(LoaderPrivileges, LoaderStartsWithoutTheNullDevice) {
  const test::Folder folder;
  const std::string path = folder / "a.nc";
  test::write_wind(path, NC_NETCDF4);
  set_program(WINDSPLAT_PROGRAM);
  const pid_t id = ::fork();
  ASSERT_GE(id, 0);
  if (id == 0) ::_exit(read_without_devices(path));
  int status = 0;
  ASSERT_EQ(::waitpid(id, &status, 0), id);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 2) GTEST_SKIP() << "mounts are not permitted here";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace windsplat::data::loader
