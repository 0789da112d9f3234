// Files that decode to far more than their size: `inspect` stays small, and not much slower than of
// a plain file.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <malloc.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/data/formats/netcdf/hdf5_maker.hpp"
#include "tests/unit/data/loader_files.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

extern char** environ;  // POSIX requires programs to declare it

namespace windsplat::data::test {
namespace {

// Resources used by a process and its loader: processor time, and the memory of the larger one.
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
  // A child counts this process's peak as its own until it executes another program.
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

// Padding bytes, which allow more to be decoded.
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

std::uintmax_t stored_bytes(const std::string& path) {
  if (!std::filesystem::is_directory(path)) return std::filesystem::file_size(path);
  std::uintmax_t bytes = 0;
  for (const auto& one : std::filesystem::directory_iterator(path)) bytes += one.file_size();
  return bytes;
}

// A large triangle and small ones, which ask for a lattice of 16 samples for each.
void write_cells(const std::string& path) {
  constexpr std::size_t cells = 600'000;
  NetcdfMaker file(path);
  const int node = file.dimension("node", 6);
  const int face = file.dimension("face", cells);
  const int topology = file.variable("mesh", NC_INT, {});
  file.text(topology, "cf_role", "mesh_topology");
  file.number(topology, "topology_dimension", NC_INT, {2});
  file.text(topology, "node_coordinates", "x y");
  file.text(topology, "face_node_connectivity", "corners");
  file.text(file.variable("x", NC_DOUBLE, {node}, {0, 100, 0, 0, 0.001, 0}), "units",
            "degrees_east");
  file.text(file.variable("y", NC_DOUBLE, {node}, {0, 0, 50, 0, 0, 0.001}), "units",
            "degrees_north");
  std::vector<double> corners{0, 1, 2};
  while (corners.size() < 3 * cells) corners.insert(corners.end(), {3, 4, 5});
  file.deflate(
      file.variable("corners", NC_INT, {face, file.dimension("three", 3)}, std::move(corners)));
  file.deflate(file.variable("t", NC_FLOAT, {face}, std::vector<double>(cells, 1)));
}

// Named by what each file amplifies.
const std::map<std::string, std::function<void(const std::string&)>>& hostile_files() {
  static const std::map<std::string, std::function<void(const std::string&)>> all{
      {"cells_of_a_mesh", write_cells},
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
  ASSERT_LT(stored_bytes(path), 1U << 20);
  const Cost cost = inspect(path);
#ifndef WINDSPLAT_SANITIZED  // its shadow memory counts
  // Measured beside it, so that both are slow on a busy machine.
  const std::string plain = folder / "plain.h5";
  {
    const Hdf5Maker file(plain);
    deflated_set(file, "u", {4, 8, 8}, {4, 8, 8}, 1);
  }
  constexpr double times = 20;
  EXPECT_LT(cost.cpu_s, times * inspect(plain).cpu_s);
  EXPECT_LT(cost.resident_kib, 200 * 1000);
#endif
  // Beyond the limits of opening: an axis of 2^24, coordinates of 3000 x 3000, more objects than a
  // file of that size can hold. The other files are described.
  const std::set<std::string> refused{"groups_of_groups", "links_to_one_variable", "long_axis",
                                      "positions"};
  EXPECT_EQ(cost.is_read, refused.count(GetParam()) == 0);
}

// Two arrays of 32 MB in less than 1 MB, as written by regional models.
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
