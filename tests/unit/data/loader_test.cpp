// Reading in a separate process: values equal those of in-process reading, and any failure of the
// process is an error of the call. Faulty loaders are scripts of the test.
#include "server/data/loader/loader.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "loader_files.hpp"
#include "netcdf_maker.hpp"
#include "server/data/loader/messages.hpp"
#include "server/data/open/open.hpp"
#include "server/data/resident/store.hpp"

namespace windsplat::data::loader {
namespace {

using std::chrono::milliseconds;
using test::Folder;
using test::NetcdfMaker;
using testing::HasSubstr;

class Loader : public testing::Test {
 protected:
  void SetUp() override { set_program(WINDSPLAT_PROGRAM); }
  void TearDown() override { set_program(WINDSPLAT_PROGRAM); }

  static Result<std::unique_ptr<RemoteSource>> open_path(const std::string& path,
                                                         Limits limits = {}) {
    auto location = locate(path);
    if (!location) return location.error();
    return open(std::move(*location), std::move(limits));
  }

  static std::unique_ptr<RemoteSource> opened(const std::string& path, Limits limits = {}) {
    auto source = open_path(path, std::move(limits));
    EXPECT_TRUE(source) << source.error().message;
    return source ? std::move(*source) : nullptr;
  }

  Folder folder_;
};

void expect_same(const Volume& a, const Volume& b) {
  EXPECT_EQ(a.dims, b.dims);
  EXPECT_EQ(a.components, b.components);
  EXPECT_EQ(a.range, b.range);
  EXPECT_EQ(a.masked, b.masked);
  ASSERT_EQ(a.bytes(), b.bytes());
  EXPECT_EQ(std::memcmp(a.component(0), b.component(0), a.bytes()), 0);
}

// Every field and every step, bit for bit.
void expect_same_as_here(const std::string& path) {
  auto here = open_file(path);
  ASSERT_TRUE(here) << here.error().message;
  auto location = locate(path);
  ASSERT_TRUE(location);
  auto there = open(*location);
  ASSERT_TRUE(there) << there.error().message;
  EXPECT_EQ(encode_info((*there)->info()), encode_info((*here)->info())) << path;
  for (std::size_t f = 0; f < (*here)->info().fields.size(); ++f) {
    for (std::size_t s = 0; s < (*here)->info().steps.size(); ++s) {
      auto a = (*here)->read(f, s);
      auto b = (*there)->read(f, s);
      ASSERT_TRUE(a) << a.error().message;
      ASSERT_TRUE(b) << b.error().message;
      expect_same(*a, *b);
    }
  }
}

TEST_F(Loader, ClassicFilesReadAsInThisProcess) {
  for (const int mode : {0, NC_64BIT_OFFSET, NC_64BIT_DATA}) {
    const std::string path = folder_ / "classic.nc";
    test::write_wind(path, mode);
    expect_same_as_here(path);
  }
}

TEST_F(Loader, Netcdf4FilesReadAsInThisProcess) {
  const std::string path = folder_ / "four.nc";
  test::write_wind(path, NC_NETCDF4);
  expect_same_as_here(path);
}

// Unwritten chunks in a file without fill values: HDF5 leaves the destination unchanged, and the
// shared memory contained another field. They must be masked.
TEST_F(Loader, UnwrittenSamplesHoldNothingOfAnEarlierVolume) {
  const std::string path = folder_ / "unfilled.nc";
  {
    NetcdfMaker file(path);
    const int y = file.axis("lat", {0, 10}, "degrees_north");
    const int x = file.axis("lon", {0, 10, 20}, "degrees_east");
    file.variable("a", NC_FLOAT, {y, x}, test::counting(6, 1));
    const int b = file.variable("b", NC_FLOAT, {y, x});
    file.chunk(b, {2, 3});
    ASSERT_EQ(nc_def_var_fill(file.id(), b, NC_NOFILL, nullptr), NC_NOERR);
  }
  const auto source = opened(path);
  ASSERT_TRUE(source);
  const auto a = source->read(0, 0);
  const auto b = source->read(1, 0);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->range, (std::array<float, 2>{1, 6}));
  EXPECT_EQ(b->masked, 6);
}

// Number of descriptors of this process for volume memory.
std::size_t transfers_kept() {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code closed;
    const auto target = std::filesystem::read_symlink(entry.path(), closed).native();
    count += target.find("windsplat-volume") != std::string::npos ? 1 : 0;
  }
  return count;
}

// MiB of resident shared memory mapped by another process, if the system reports it.
double shared_by(pid_t id) {
  std::ifstream file("/proc/" + std::to_string(id) + "/status");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("RssShmem:")) return std::stod(line.substr(9)) / 1024;
  }
  return 0;
}

// The shared memory is reused for the scalar and reallocated for the vector, which is too large to
// be kept.
TEST_F(Loader, SmallAndLargeVolumesReadAsInThisProcess) {
  std::ofstream(folder_ / "large.json")
      << R"({"windsplat": "raw", "file": "large.raw", "type": "float32", "endian": "little",
             "dims": {"x": 160, "y": 150, "z": 128}, "steps": {"count": 2},
             "fields": [{"name": "cloud"}, {"name": "wind", "components": ["u", "v", "w"]}]})";
  constexpr std::size_t samples = std::size_t{160} * 150 * 128;
  std::vector<float> values(8 * samples);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i % 1000003);
  std::ofstream(folder_ / "large.raw", std::ios::binary)
      .write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size() * sizeof(float)));
  expect_same_as_here(folder_ / "large.json");
  auto source = opened(folder_ / "large.json");
  ASSERT_TRUE(source);
  for (const std::size_t field : {1U, 0U, 1U}) {
    const auto volume = source->read(field, 1);
    ASSERT_TRUE(volume) << volume.error().message;
    const bool is_cloud = source->info().fields[field].name == "cloud";
    EXPECT_EQ(volume->values[0], static_cast<float>(((is_cloud ? 4 : 5) * samples) % 1000003));
    EXPECT_EQ(transfers_kept(), is_cloud ? 1U : 0U);
    // No memory for 35 MiB in addition to the copy.
    EXPECT_LT(shared_by(source->process()), is_cloud ? 13 : 1);
  }
}

// Files referenced by a header are part of the dataset.
TEST_F(Loader, ChangedCompanionFileIsDetected) {
  std::ofstream(folder_ / "c.json")
      << R"({"windsplat": "raw", "file": "c.raw", "type": "float32", "endian": "little",
             "dims": {"x": 4, "y": 4, "z": 4}, "fields": [{"name": "cloud"}]})";
  test::write_floats(folder_ / "c.raw", 64, 1);
  Store store(
      {1 << 20, Storage::float32, [](const Location& location) -> Result<std::unique_ptr<Source>> {
         auto source = open(location);
         if (!source) return source.error();
         return std::unique_ptr<Source>(std::move(*source));
       }});
  ASSERT_EQ(store.add(folder_ / "c.json").value()->volume("cloud", 0).value()->values[0], 1.0F);
  EXPECT_TRUE(store.look_for_changes(0).empty());
  test::write_floats(folder_ / "c.raw", 64, 2);
  EXPECT_EQ(store.look_for_changes(0), std::vector<std::string>{"c"});
  EXPECT_EQ(store.find("c").value()->volume("cloud", 0).value()->values[0], 2.0F);
}

TEST_F(Loader, ForeignFilesReadAsInThisProcess) {
  const char* given = std::getenv("WINDSPLAT_TEST_DATA");
  const std::string data = given != nullptr ? given : WINDSPLAT_SOURCE_DIR "/build/test-data";
  int files = 0;
  for (const char* name : {"ced1.lf00.t00z.eta.nc", "contour.cdf", "nc4uvt.nc",
                           "rectilinear_grid_3D.nc", "vinth2p.nc"}) {
    ASSERT_TRUE(std::filesystem::exists(data + '/' + name)) << "run scripts/fetch-test-data";
    expect_same_as_here(data + '/' + name);
    ++files;
  }
  EXPECT_EQ(files, 5);
}

TEST_F(Loader, FileNameMayLookLikeAUrl) {
  for (const char* name : {"file.nc#mode=zarr,s3", "http:x.nc", "[dap4]x.nc", "dods:.nc"}) {
    const std::string path = folder_ / name;
    test::write_wind(folder_ / "plain.nc", NC_NETCDF4);
    std::filesystem::rename(folder_ / "plain.nc", path);
    expect_same_as_here(path);
  }
}

// Two groups of one variable each, of the same name.
void write_two_groups(const std::string& path) {
  NetcdfMaker file(path);
  const int y = file.dimension("y", 2);
  const int x = file.dimension("x", 3);
  const std::array<int, 2> dims{y, x};
  for (const auto& [name, first] : {std::pair("a", 1.0F), std::pair("b", 100.0F)}) {
    int group = -1;
    int variable = -1;
    ASSERT_EQ(nc_def_grp(file.id(), name, &group), NC_NOERR);
    ASSERT_EQ(nc_def_var(group, "q", NC_FLOAT, 2, dims.data(), &variable), NC_NOERR);
    const std::vector<double> values = test::counting(6, first);
    ASSERT_EQ(nc_put_var_double(group, variable, values.data()), NC_NOERR);
  }
}

TEST_F(Loader, SeriesKeepsItsPatternAsName) {
  test::write_wind(folder_ / "part_1.nc", 0);
  test::write_wind(folder_ / "part_2.nc", 0);
  const auto source = opened(folder_ / "part_*.nc");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().source, "part_*.nc");
  EXPECT_EQ(source->info().title, open_file(folder_ / "part_*.nc").value()->info().title);
  expect_same_as_here(folder_ / "part_*.nc");
}

TEST_F(Loader, NamedGroupIsRead) {
  const std::string path = folder_ / "two.nc";
  write_two_groups(path);
  for (const auto& [group, first] : {std::pair("#/a", 1.0F), std::pair("#/b", 100.0F)}) {
    const auto source = opened(path + group);
    ASSERT_TRUE(source);
    const auto volume = source->read(0, 0);
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->range, (std::array<float, 2>{first, first + 5}));
    EXPECT_TRUE(source->info().notes.empty()) << source->info().notes.front();
    expect_same_as_here(path + group);
    source->release();  // also by the next loader
    const auto again = source->read(0, 0);
    ASSERT_TRUE(again) << again.error().message;
    expect_same(*volume, *again);
  }
  const auto absent = open_path(path + "#/nope");
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().kind, ErrorKind::not_found);
  EXPECT_EQ(absent.error().message, "'two.nc' has no group '/nope', but '/a', '/b'");
}

TEST_F(Loader, InvalidFileGivesTheSameErrorAsInThisProcess) {
  const std::string path = folder_ / "text.nc";
  std::ofstream(path) << "no dataset, whatever its name";
  const auto here = open_file(path);
  const auto there = open_path(path);
  ASSERT_FALSE(here);
  ASSERT_FALSE(there);
  EXPECT_EQ(there.error().kind, here.error().kind);
  EXPECT_EQ(there.error().message, here.error().message);
}

// HDF5 reads external files that a dataset names.
TEST_F(Loader, ExternalStorageIsRefusedByName) {
  const std::string other = folder_ / "other";
  test::write_floats(other, 64, 42.0F);
  const std::string path = folder_ / "crafted.nc";
  test::write_external_storage(path, other);
  for (const auto& source : {open_file(path).error(), open_path(path).error()}) {
    EXPECT_EQ(source.kind, ErrorKind::bad_data);
    EXPECT_THAT(source.message, HasSubstr("'secret' is in another file ('" + other + "')"));
  }
}

TEST_F(Loader, ExternalLinkIsRefusedByName) {
  const std::string other = folder_ / "other.nc";
  test::write_wind(other, NC_NETCDF4);
  const std::string path = folder_ / "crafted.nc";
  test::write_external_link(path, other, "T");
  const auto there = open_path(path);
  ASSERT_FALSE(there);
  EXPECT_EQ(there.error().kind, ErrorKind::bad_data);
  EXPECT_THAT(there.error().message, HasSubstr("external link, which is not followed: '/linked'"));
}

TEST_F(Loader, CrashIsAnErrorAndTheNextReadStartsAnother) {
  const std::string path = folder_ / "a.nc";
  test::write_wind(path, NC_NETCDF4);
  const auto source = opened(path);
  ASSERT_TRUE(source);
  const auto first = source->read(0, 1);
  ASSERT_TRUE(first);
  const pid_t id = source->process();
  ASSERT_GT(id, 0);
  ASSERT_EQ(::kill(id, SIGSTOP), 0);  // so that it ends during a read
  std::thread killer([id] {
    std::this_thread::sleep_for(milliseconds(100));
    ::kill(id, SIGKILL);
  });
  const auto broken = source->read(0, 1);
  killer.join();
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().kind, ErrorKind::bad_data);
  EXPECT_EQ(broken.error().message,
            "the loader of 'a.nc' was ended by signal 9 while reading 'wind'");
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
            "the loader of 'a.nc' was ended after 0.2 s while reading 'wind'");
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
    EXPECT_EQ(stopped.error().message,
              "the loader of 'a.nc' made no progress for 3.0 s and was ended while reading 'wind'");
  });
  EXPECT_TRUE(other->read(0, 0));
  EXPECT_FALSE(over) << "the other is read while this one hangs";
  reader.join();
  EXPECT_EQ(::kill(id, 0), -1) << "it is gone";
  const auto again = source->read(0, 0);
  EXPECT_TRUE(again) << again.error().message;
  EXPECT_NE(source->process(), id);
}

TEST_F(Loader, ItsMemoryAndTransfersAreCountedWhileItRuns) {
  const std::string path = folder_ / "a.nc";
  test::write_wind(path, NC_NETCDF4);
  Limits limits;
  limits.budget = std::make_shared<Budget>(std::uint64_t{64} << 20);
  const auto source = opened(path, limits);
  ASSERT_TRUE(source);
  const std::uint64_t of_process = limits.budget->counts().bytes;
  EXPECT_GE(of_process, std::uint64_t{8} << 20);
  ASSERT_TRUE(source->read(0, 0));
  EXPECT_GT(limits.budget->counts().bytes, of_process) << "the memory for the next volume is kept";
  source->release();
  EXPECT_EQ(limits.budget->counts().bytes, 0U);
  limits.budget = std::make_shared<Budget>(std::uint64_t{1} << 20);
  const auto refused = open_path(path, limits);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::out_of_memory);
  EXPECT_THAT(refused.error().message, testing::HasSubstr("needs 8.0 MiB"));
}

TEST_F(Loader, ExceedingTheBudgetWhileOpeningIsAnError) {
  const std::string path = folder_ / "a.nc";
  test::write_positions(path, 1500);  // 36 MB of coordinates
  Limits limits;
  // Memory of an idle loader, with some tolerance.
  limits.budget = std::make_shared<Budget>((std::uint64_t{8} << 20) + (std::uint64_t{64} << 10));
  for (int n = 0; n < 3; ++n) {
    const auto source = open_path(path, limits);
    // It may have opened the file between two checks: the loader is gone, and its result is valid.
    if (source) {
      EXPECT_EQ((*source)->process(), -1);
      EXPECT_GT((*source)->info().stored_bytes, 0U);
    } else {
      EXPECT_EQ(source.error().kind, ErrorKind::out_of_memory);
    }
    EXPECT_EQ(limits.budget->counts().bytes, 0U);
  }
}

#ifndef WINDSPLAT_SANITIZED  // whose shadow memory counts
TEST_F(Loader, VolumeIsTheSameWhenTransferMemoryIsNotKept) {
  const std::string path = folder_ / "a.nc";
  test::write_large(path);
  Limits limits;
  const auto keeps = opened(path, limits);
  // More than an eighth of this.
  limits.budget = std::make_shared<Budget>(std::uint64_t{32} << 20);
  const auto keeps_not = opened(path, limits);
  ASSERT_TRUE(keeps && keeps_not);
  const std::uint64_t before = limits.budget->counts().bytes;
  for (int n = 0; n < 3; ++n) {
    const auto a = keeps->read(0, 0);
    const auto b = keeps_not->read(0, 0);
    ASSERT_TRUE(a && b);
    expect_same(*a, *b);
    EXPECT_LT(limits.budget->counts().bytes, before + (std::uint64_t{4} << 20));
  }
}
#endif

TEST_F(Loader, ReadCanBeCancelledFromAnotherThread) {
  const std::string path = folder_ / "a.nc";
  test::write_wind(path, NC_NETCDF4);
  const auto source = opened(path);
  ASSERT_TRUE(source);
  source->cancel();  // of nothing
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

#ifndef WINDSPLAT_SANITIZED
// A chunk of 48 MiB, compressed to a few kilobytes.
TEST_F(Loader, FileThatDecompressesBeyondTheMemoryIsAnError) {
  const std::string path = folder_ / "bomb.nc";
  {
    NetcdfMaker file(path);
    const int z = file.dimension("z", NC_UNLIMITED);
    const int y = file.dimension("y", 512);
    const int x = file.dimension("x", 512);
    const int v = file.variable("T", NC_FLOAT, {z, y, x}, std::vector<double>(512 * 512, 1));
    file.chunk(v, {48, 512, 512});
    file.deflate(v);
  }
  Limits limits;
  limits.memory_bytes = std::uint64_t{8} << 20;
  const auto small = opened(path, limits);
  ASSERT_TRUE(small);
  EXPECT_FALSE(small->read(0, 0));
  limits.memory_bytes = std::uint64_t{1} << 30;
  const auto large = opened(path, limits);
  ASSERT_TRUE(large);
  const auto read = large->read(0, 0);
  EXPECT_TRUE(read) << read.error().message;
}
#endif

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
  ASSERT_EQ(::prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0),
            0);  // adopts orphans
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
  ::kill(id, SIGSTOP);  // it cannot check its socket
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
