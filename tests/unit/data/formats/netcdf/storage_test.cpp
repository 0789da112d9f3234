// HDF5 files whose data are in other files, were never written, or are far larger than the file:
// each is refused or masked by name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <malloc.h>

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/formats/netcdf/hdf5_maker.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::HasSubstr;

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
                       "chunks that were never written are masked: "
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

// Two chunks with the same number could not be distinguished as present or absent.
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
  // Files written by versions before 4.4 have no _NCProperties.
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

// The library reports an absent chunk as present once it was read: it must also be masked in the
// second block.
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

// Bytes have no default fill value in CF: unwritten ones are read as -127.
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

// Chunks with several steps are cached for the next step, for all variables whose chunks fit within
// one limit.
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

}  // namespace
}  // namespace windsplat::data::test
