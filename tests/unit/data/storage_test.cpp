// HDF5 data that are external, unwritten, or far larger than the file: each is refused or masked by
// name, and `inspect` stays small and fast.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <malloc.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dataset_probe.hpp"
#include "loader_files.hpp"
#include "netcdf_maker.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"

extern char** environ;  // POSIX leaves its declaration to the program

namespace windsplat::data::test {
namespace {

using testing::HasSubstr;
using Lengths = std::vector<hsize_t>;

// A file written by HDF5 itself; sets are float32.
class Hdf5Maker {
 public:
  explicit Hdf5Maker(const std::string& path)
      : id_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {
    EXPECT_GE(id_, 0);
  }
  ~Hdf5Maker() { EXPECT_GE(H5Fclose(id_), 0); }
  Hdf5Maker(const Hdf5Maker&) = delete;
  Hdf5Maker& operator=(const Hdf5Maker&) = delete;
  [[nodiscard]] hid_t id() const { return id_; }

  using Plan = std::function<void(hid_t)>;
  // `use` is given the open dataset.
  void set(const std::string& name, const Lengths& dims, const Plan& plan, const Plan& use) const {
    const hid_t space = H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr);
    const hid_t how = H5Pcreate(H5P_DATASET_CREATE);
    plan(how);
    const hid_t set =
        H5Dcreate2(id_, name.c_str(), H5T_IEEE_F32LE, space, H5P_DEFAULT, how, H5P_DEFAULT);
    EXPECT_GE(set, 0) << name;
    use(set);
    H5Dclose(set);
    H5Pclose(how);
    H5Sclose(space);
  }
  // 4 x 8 x 8 ones.
  void ones(const std::string& name) const {
    set(
        name, {4, 8, 8}, [](hid_t) {},
        [](hid_t set) {
          const std::vector<float> values(256, 1);
          EXPECT_GE(H5Dwrite(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
                    0);
        });
  }

 private:
  hid_t id_;
};

std::vector<unsigned char> deflated_zeros(std::size_t count) {
  const std::vector<unsigned char> zeros(std::size_t{1} << 20, 0);
  std::vector<unsigned char> out(count / 900 + 4096);
  z_stream stream{};
  EXPECT_EQ(deflateInit(&stream, 9), Z_OK);
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  for (std::size_t done = 0; done < count;) {
    const std::size_t size = std::min(zeros.size(), count - done);
    stream.next_in = const_cast<unsigned char*>(zeros.data());
    stream.avail_in = static_cast<uInt>(size);
    EXPECT_EQ(deflate(&stream, Z_NO_FLUSH), Z_OK);
    done += size;
  }
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

// Chunks of zeros, `written` of them along the first dimension.
void deflated_set(const Hdf5Maker& file, const std::string& name, const Lengths& dims,
                  const Lengths& chunk, hsize_t written) {
  std::size_t bytes = sizeof(float);
  for (const hsize_t length : chunk) bytes *= length;
  const auto stored = deflated_zeros(bytes);
  file.set(
      name, dims,
      [&](hid_t plan) {
        H5Pset_chunk(plan, static_cast<int>(chunk.size()), chunk.data());
        H5Pset_shuffle(plan);  // which changes no zeros, but takes memory
        H5Pset_deflate(plan, 9);
      },
      [&](hid_t set) {
        Lengths at(chunk.size(), 0);
        for (hsize_t n = 0; n < written; ++n, at[0] += chunk[0]) {
          EXPECT_GE(H5Dwrite_chunk(set, H5P_DEFAULT, 0, at.data(), stored.size(), stored.data()),
                    0);
        }
      });
}

void expect_refused(const std::string& path, const std::string& part) {
  const auto source = open_file(path);
  ASSERT_FALSE(source) << path;
  EXPECT_EQ(source.error().kind, ErrorKind::bad_data);
  EXPECT_THAT(source.error().message, HasSubstr(part));
}

TEST(Storage, VirtualDatasetIsRefusedByName) {
  const Folder folder;
  { Hdf5Maker(folder / "source.h5").ones("u"); }
  {
    const Hdf5Maker file(folder / "a.h5");
    const std::array<hsize_t, 3> dims{4, 8, 8};
    const hid_t space = H5Screate_simple(3, dims.data(), nullptr);
    file.set(
        "u", {4, 8, 8},
        [&](hid_t plan) { EXPECT_GE(H5Pset_virtual(plan, space, "source.h5", "u", space), 0); },
        [](hid_t) {});
    H5Sclose(space);
  }
  expect_refused(folder / "a.h5",
                 "'u' is a virtual dataset, whose data are elsewhere "
                 "('source.h5')");
}

TEST(Storage, DanglingAndCyclicLinksAreRefusedByName) {
  const Folder folder;
  {
    const Hdf5Maker file(folder / "nowhere.h5");
    file.ones("u");
    H5Lcreate_soft("/nothing", file.id(), "w", H5P_DEFAULT, H5P_DEFAULT);
  }
  expect_refused(folder / "nowhere.h5", "a link that leads nowhere: '/w'");
  {
    const Hdf5Maker file(folder / "round.h5");
    file.ones("u");
    H5Lcreate_hard(file.id(), "/", file.id(), "g", H5P_DEFAULT, H5P_DEFAULT);
  }
  expect_refused(folder / "round.h5", "a group that contains itself: '/g'");
}

TEST(Storage, MissingFilterIsNamed) {
  const Folder folder;
  {
    const Hdf5Maker file(folder / "a.h5");
    file.set(
        "u", {4, 8, 8},
        [](hid_t plan) {
          const Lengths chunk{1, 8, 8};
          H5Pset_chunk(plan, 3, chunk.data());
          EXPECT_GE(H5Pset_filter(plan, 32015, H5Z_FLAG_OPTIONAL, 0, nullptr), 0);
        },
        [](hid_t) {});
    file.ones("v");
  }
  const auto source = open_file(folder / "a.h5");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->info().find("u"), nullptr);
  EXPECT_THAT(reason_of((*source)->info(), "u"), HasSubstr("the filter 32015"));
  EXPECT_EQ(volume_of(**source, "v").masked, 0);
}

TEST(Storage, UnwrittenDataAreMasked) {
  const Folder folder;
  {
    const Hdf5Maker file(folder / "a.h5");
    file.set(
        "nothing", {4, 8, 8}, [](hid_t) {}, [](hid_t) {});
    file.set(
        "some", {4, 8, 8},
        [](hid_t plan) {
          const Lengths chunk{1, 4, 8};
          H5Pset_chunk(plan, 3, chunk.data());
        },
        [](hid_t set) {
          const std::vector<float> values(32, 7);
          const Lengths at{2, 4, 0};
          EXPECT_GE(H5Dwrite_chunk(set, H5P_DEFAULT, 0, at.data(), 128, values.data()), 0);
        });
    file.ones("all");
  }
  const auto source = open_file(folder / "a.h5");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ(volume_of(**source, "nothing").masked, 256);
  EXPECT_EQ(volume_of(**source, "all").masked, 0);
  const Volume some = volume_of(**source, "some");
  EXPECT_EQ(some.masked, 256 - 32);
  for (std::size_t n = 0; n < 256; ++n) {
    const bool written = n / 64 == 2 && n % 64 >= 32;
    EXPECT_EQ(std::isfinite(some.values[n]), written) << n;
  }
  EXPECT_TRUE(has_note((*source)->info(),
                       "masked where nothing was ever written, whatever the fill value: "
                       "'nothing' (all of it), 'some' (7 of 8 chunks)"));
  EXPECT_FALSE(has_note((*source)->info(), "'all'"));
}

TEST(Storage, LookupOfManyChunksIsPartial) {
  const Folder folder;
  {
    const Hdf5Maker file(folder / "a.h5");
    deflated_set(file, "u", {5000, 4, 4}, {1, 4, 4}, 1);
    deflated_set(file, "v", {5000, 4, 4}, {1, 4, 4}, 5000);
  }
  const auto source = open_file(folder / "a.h5");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_TRUE(has_note((*source)->info(), ": 'u' (4095 of the first 4096 chunks)"));
  EXPECT_FALSE(has_note((*source)->info(), "'v'"));
  EXPECT_EQ(volume_of(**source, "u").masked, 4999 * 16);
  EXPECT_EQ(volume_of(**source, "v").masked, 0);
}

// Two chunks with one number would be confused: present or absent.
TEST(Storage, MoreChunksThanValuesAreRefused) {
  const Folder folder;
  {
    const Hdf5Maker file(folder / "a.h5");
    const hsize_t many = hsize_t{1} << 30;
    file.set(
        "u", {many, many, many},
        [](hid_t plan) {
          const Lengths chunk{1, 1, 1};
          H5Pset_chunk(plan, 3, chunk.data());
        },
        [](hid_t) {});
    file.ones("v");
  }
  const auto source = open_file(folder / "a.h5");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_THAT(reason_of((*source)->info(), "u"), HasSubstr("more chunks than can be counted"));
  EXPECT_EQ(volume_of(**source, "v").masked, 0);
}

TEST(Storage, OnlyNetcdfIsCalledNetcdf) {
  const Folder folder;
  { Hdf5Maker(folder / "a.h5").ones("u"); }
  {
    NetcdfMaker file(folder / "a.nc");
    file.variable("u", NC_FLOAT, {file.dimension("y", 4), file.dimension("x", 4)}, counting(16));
  }
  // Files of versions before 4.4 have no properties.
  std::filesystem::copy_file(folder / "a.nc", folder / "old.nc");
  {
    const hid_t file = H5Fopen((folder / "old.nc").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    EXPECT_GE(H5Adelete(file, "_NCProperties"), 0);
    H5Fclose(file);
  }
  for (const auto& [name, format] : std::map<std::string, std::string>{
           {"a.h5", "HDF5"}, {"a.nc", "netCDF-4"}, {"old.nc", "netCDF-4"}}) {
    const auto source = open_file(folder / name);
    ASSERT_TRUE(source) << source.error().message;
    EXPECT_EQ((*source)->info().format, format) << name;
  }
}

// The library reports an absent chunk as present after it was read: it is masked in the second
// block, too.
TEST(Storage, MissingChunkIsMaskedInEveryBlock) {
  const Folder folder;
  {
    const Hdf5Maker file(folder / "a.h5");
    deflated_set(file, "u", {10, 1024, 1024}, {5, 1024, 1024}, 1);
  }
  const auto source = open_file(folder / "a.h5");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ(volume_of(**source, "u").masked, 5 * 1024 * 1024);
}

// Bytes have no default fill value in CF: unwritten ones read as -127.
TEST(Storage, VariableShorterThanTheUnlimitedDimensionIsMasked) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "a.nc");
    const int t = file.dimension("time", NC_UNLIMITED);
    const int y = file.dimension("y", 4);
    const int x = file.dimension("x", 4);
    file.variable("long", NC_FLOAT, {t, y, x}, std::vector<double>(48, 2));
    file.variable("short", NC_BYTE, {t, y, x}, std::vector<double>(16, 3));
  }
  const auto source = open_file(folder / "a.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ(volume_of(**source, "long", 2).masked, 0);
  EXPECT_EQ(volume_of(**source, "short", 0).masked, 0);
  EXPECT_EQ(volume_of(**source, "short", 2).masked, 16);
}

TEST(Storage, ChunksAboveTheLimitAreRefused) {
  const Folder folder;
  {
    const Hdf5Maker file(folder / "a.h5");
    deflated_set(file, "u", {257, 1024, 1024}, {257, 1024, 1024}, 0);
  }
  expect_refused(folder / "a.h5", "'u' is its chunks have more than 1073741824 bytes");
}

// A chunk needed by many blocks is decoded once, and its values are right.
TEST(Storage, ChunkLargerThanTheLibraryCacheIsReadWhole) {
  const Folder folder;
  {
    const Hdf5Maker file(folder / "a.h5");
    deflated_set(file, "u", {6, 1024, 1024}, {6, 1024, 1024}, 1);
  }
  const auto source = open_file(folder / "a.h5");
  ASSERT_TRUE(source) << source.error().message;
  const Volume volume = volume_of(**source, "u");
  EXPECT_EQ(volume.masked, 0);
  EXPECT_EQ(volume.range[1], 0);
}

// Chunks of several steps are kept for the next step, as far as those of all variables fit
// together.
TEST(Storage, MetadataOfAllVariablesShareOneLimit) {
  const Folder folder;
  const Lengths chunk{2, 4, 1024, 1024};  // 32 MiB
  const std::string names = "abcdefgh";
  {
    NetcdfMaker file(folder / "a.nc");
    const int t = file.axis("time", {0, 6}, "hours since 2001-01-01");
    const int z = file.dimension("z", chunk[1]);
    const int y = file.dimension("y", chunk[2]);
    const int x = file.dimension("x", chunk[3]);
    for (const char name : names) {
      const int v = file.variable(std::string(1, name), NC_FLOAT, {t, z, y, x});
      file.deflate(v);
      file.chunk(v, {chunk.begin(), chunk.end()});
    }
  }
  const auto stored = deflated_zeros(std::size_t{32} << 20);
  const hid_t file = H5Fopen((folder / "a.nc").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  for (const char name : names) {
    const hid_t set = H5Dopen2(file, std::string(1, name).c_str(), H5P_DEFAULT);
    const Lengths at(4, 0);
    EXPECT_GE(H5Dwrite_chunk(set, H5P_DEFAULT, 0, at.data(), stored.size(), stored.data()), 0);
    H5Dclose(set);
  }
  H5Fclose(file);
  const auto source = open_file(folder / "a.nc");
  ASSERT_TRUE(source) << source.error().message;
  const auto used = [] {
    const auto info = ::mallinfo2();
    return info.hblkhd + info.uordblks;
  };
  const std::size_t before = used();
  for (const char name : names) {
    EXPECT_EQ(volume_of(**source, std::string(1, name)).masked, 0) << name;
    EXPECT_LE(used(), before + (std::size_t{140} << 20)) << name;
  }
}

// Cost of a process and its loader: processor time and the larger peak memory.
struct Cost {
  double cpu_s = 0;
  long resident_kib = 0;
  bool is_read = false;
};

Cost inspect(const std::string& path) {
  std::string program = WINDSPLAT_PROGRAM;
  std::string command = "inspect";
  std::string file = path;
  std::array<char*, 4> words{program.data(), command.data(), file.data(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int out : {1, 2}) {
    posix_spawn_file_actions_addopen(&actions, out, "/dev/null", O_WRONLY, 0);
  }
  // A child inherits this process's peak memory until it runs another program.
  ::malloc_trim(0);
  const int peak = ::open("/proc/self/clear_refs", O_WRONLY | O_CLOEXEC);
  EXPECT_EQ(::write(peak, "5", 1), 1);
  ::close(peak);
  pid_t id = -1;
  EXPECT_EQ(posix_spawn(&id, program.c_str(), &actions, nullptr, words.data(), environ), 0);
  posix_spawn_file_actions_destroy(&actions);
  rusage used{};
  int status = 0;
  EXPECT_EQ(wait4(id, &status, 0, &used), id);
  EXPECT_TRUE(WIFEXITED(status) && (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 3)) << path;
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
  };
  return {seconds(used.ru_utime) + seconds(used.ru_stime), used.ru_maxrss,
          WIFEXITED(status) && WEXITSTATUS(status) == 0};
}

// Bytes that permit more to be decoded.
void pad(const Hdf5Maker& file) {
  file.set(
      "padding", {200000}, [](hid_t) {},
      [](hid_t set) {
        const std::vector<float> values(200000, 1);
        EXPECT_GE(H5Dwrite(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
      });
}

// A Zarr store without a chunk.
void write_empty_store(const std::string& path) {
  std::filesystem::create_directory(path);
  std::ofstream(path + "/.zarray") << R"({"zarr_format": 2, "shape": [256, 256, 256],
    "chunks": [1, 1, 1], "dtype": "<f4", "order": "C", "fill_value": null, "filters": null,
    "compressor": null})";
}

std::uintmax_t bytes_of(const std::string& path) {
  if (!std::filesystem::is_directory(path)) return std::filesystem::file_size(path);
  std::uintmax_t bytes = 0;
  for (const auto& one : std::filesystem::directory_iterator(path)) bytes += one.file_size();
  return bytes;
}

// Named by what each amplifies.
const std::map<std::string, std::function<void(const std::string&)>>& hostile_files() {
  static const std::map<std::string, std::function<void(const std::string&)>> all{
      {"files_of_one_value", write_empty_store},
      {"one_chunk",
       [](const std::string& path) {
         deflated_set(Hdf5Maker(path), "u", {200, 1024, 1024}, {200, 1024, 1024}, 1);
       }},
      {"chunks_of_one_value",
       [](const std::string& path) {
         deflated_set(Hdf5Maker(path), "u", {256, 256, 256}, {1, 1, 1}, 1);
       }},
      {"large_chunks",
       [](const std::string& path) {
         deflated_set(Hdf5Maker(path), "u", {60, 2000, 2000}, {10, 2000, 2000}, 5);
       }},
      {"long_axis",
       [](const std::string& path) {
         deflated_set(Hdf5Maker(path), "u", {1 << 24, 4, 4}, {1 << 20, 4, 4}, 0);
       }},
      {"declared_shape",
       [](const std::string& path) {
         deflated_set(Hdf5Maker(path), "u", {500, 2000, 2000}, {1, 2000, 2000}, 1);
       }},
      {"thousands_of_variables",
       [](const std::string& path) {
         const Hdf5Maker file(path);
         for (int n = 0; n < 600; ++n) file.ones("v" + std::to_string(n));
       }},
      {"links_to_one_variable",
       [](const std::string& path) {
         const Hdf5Maker file(path);
         file.ones("u");
         for (int n = 0; n < 10000; ++n) {
           const std::string name = "l" + std::to_string(n);
           H5Lcreate_hard(file.id(), "u", file.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
         }
       }},
      {"groups_of_groups",
       [](const std::string& path) {
         const Hdf5Maker file(path);
         file.ones("u");
         for (int n = 0; n < 12; ++n) {
           const std::string name = "g" + std::to_string(n);
           const hid_t group =
               H5Gcreate2(file.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
           const std::string inner = "g" + std::to_string(n - 1);
           for (int k = 0; k < 4 && n > 0; ++k) {
             const std::string link = "c" + std::to_string(k);
             H5Lcreate_hard(file.id(), inner.c_str(), group, link.c_str(), H5P_DEFAULT,
                            H5P_DEFAULT);
           }
           H5Gclose(group);
         }
       }},
      {"positions", [](const std::string& path) { write_positions(path, 3000); }},
      {"layers",
       [](const std::string& path) {
         const Hdf5Maker file(path);
         pad(file);
         deflated_set(file, "u", {27, 1024, 1024}, {1, 1024, 1024}, 27);
       }},
      {"chunks_of_filters",
       [](const std::string& path) {
         const Hdf5Maker file(path);
         pad(file);
         deflated_set(file, "u", {20, 1024, 1024}, {5, 1024, 1024}, 4);
       }},
      {"volume_of_one_chunk",
       [](const std::string& path) {
         const Hdf5Maker file(path);
         pad(file);
         deflated_set(file, "u", {8, 1024, 1024}, {8, 1024, 1024}, 1);
       }},
  };
  return all;
}

class HostileFiles : public testing::TestWithParam<std::string> {};

TEST_P(HostileFiles, InspectIsFastAndSmall) {
  const Folder folder;
  const std::string path = folder / "a.h5";
  hostile_files().at(GetParam())(path);
  ASSERT_LT(bytes_of(path), 1U << 20);
  const Cost cost = inspect(path);
  // Above the limits of opening: an axis of 2^24, coordinates of 3000 x 3000, more objects than a
  // file of that size can contain. The others are described.
  const std::set<std::string> refused{"groups_of_groups", "links_to_one_variable", "long_axis",
                                      "positions"};
  EXPECT_EQ(cost.is_read, refused.count(GetParam()) == 0);
#ifndef WINDSPLAT_SANITIZED  // whose shadow memory counts
  EXPECT_LT(cost.cpu_s, 1);
  EXPECT_LT(cost.resident_kib, 200 * 1000);
#endif
}

// Two arrays of 32 MB in less than one, as regional models write them.
TEST(Storage, CompressedPositionsAreReadWithLittleMemory) {
  const Folder folder;
  write_positions(folder / "a.nc", 2000);
  ASSERT_LT(std::filesystem::file_size(folder / "a.nc"), 1U << 20);
  const Cost cost = inspect(folder / "a.nc");
  EXPECT_TRUE(cost.is_read);
#ifndef WINDSPLAT_SANITIZED
  EXPECT_LT(cost.resident_kib, 200 * 1000);
#endif
}

std::vector<std::string> names_of_hostile_files() {
  std::vector<std::string> out;
  for (const auto& [name, make] : hostile_files()) out.push_back(name);
  return out;
}

INSTANTIATE_TEST_SUITE_P(Storage, HostileFiles, testing::ValuesIn(names_of_hostile_files()),
                         [](const auto& about) { return about.param; });

}  // namespace
}  // namespace windsplat::data::test
