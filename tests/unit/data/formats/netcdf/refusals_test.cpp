// Invalid files: each is refused with a reason, none crashes the reader.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

#include "server/data/formats/netcdf/classic_header.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

void expect_refused(const std::string& path, ErrorKind kind, const std::string& part) {
  auto source = open_file(path);
  ASSERT_FALSE(source) << path;
  EXPECT_EQ(source.error().kind, kind) << source.error().message;
  EXPECT_NE(source.error().message.find(part), std::string::npos) << source.error().message;
}

void write_good(const std::string& path, int mode, std::size_t records = 2) {
  NetcdfMaker file(path, mode);
  const int t = file.dimension("time", NC_UNLIMITED);
  file.text(file.variable("time", NC_DOUBLE, {t}, counting(records)), "units",
            "hours since 2001-01-01");
  const int z = file.axis("lev", {1000, 500, 100}, "hPa");
  const int y = file.axis("lat", {-10, 0, 10, 20}, "degrees_north");
  const int x = file.axis("lon", {0, 5, 10, 15, 20}, "degrees_east");
  file.text(file.variable("f", NC_FLOAT, {t, z, y, x}, counting(records * 60, 1)), "units", "K");
  file.variable("h", NC_SHORT, {y, x}, counting(20, 1));
}

TEST(NetcdfRefusals, MissingAndIrregularFiles) {
  const Folder folder;
  expect_refused(folder / "absent.nc", ErrorKind::not_found, "no such file");
  expect_refused(folder / "no/folder.nc", ErrorKind::not_found, "no such file");
  expect_refused("", ErrorKind::not_found, "no file name");
  std::filesystem::create_directory(folder / "dir.nc");
  expect_refused(folder / "dir.nc", ErrorKind::bad_data,
                 "is a directory without a Zarr store (no .zgroup, .zarray or zarr.json)");
  ASSERT_EQ(::mkfifo((folder / "pipe.nc").c_str(), 0600), 0);
  expect_refused(folder / "pipe.nc", ErrorKind::bad_data, "not a regular file");
  expect_refused("/dev/null", ErrorKind::bad_data, "not a regular file");
}

TEST(NetcdfRefusals, OtherFormats) {
  const Folder folder;
  write_bytes(folder / "empty.nc", "");
  expect_refused(folder / "empty.nc", ErrorKind::bad_data, "is empty");
  write_bytes(folder / "text.nc", "netcdf text { dimensions: x = 3 ; }\n");
  expect_refused(folder / "text.nc", ErrorKind::bad_data, "not a netCDF file");
  write_bytes(folder / "three.nc", "CDF");
  expect_refused(folder / "three.nc", ErrorKind::bad_data, "not a netCDF file");
  write_bytes(folder / "cdf4.nc", std::string("CDF\x04 and more", 13));
  expect_refused(folder / "cdf4.nc", ErrorKind::bad_data, "not a netCDF file");
  write_bytes(folder / "hdf4.nc", std::string("\x0e\x03\x13\x01 and more"));
  expect_refused(folder / "hdf4.nc", ErrorKind::bad_data, "is HDF4");
  write_bytes(folder / "hdf.nc", "\x89HDF\r\n\x1a\n and nothing useful after it");
  expect_refused(folder / "hdf.nc", ErrorKind::bad_data, "truncated or damaged");
}

TEST(NetcdfRefusals, UrlsAndLibraryDirectives) {
  const Folder folder;
  expect_refused("http://127.0.0.1:9/a.nc", ErrorKind::invalid, "URL");
  expect_refused("file:///etc/passwd", ErrorKind::invalid, "URL");
  expect_refused("[mode=bytes]https://127.0.0.1:9/a.nc", ErrorKind::invalid, "URL");
  write_good(folder / "a.nc", 0);
  expect_refused((folder / "a.nc") + "#mode=zarr", ErrorKind::not_found, "no such file");
  // File names are never passed to the library, so a name that resembles its directives is an
  // ordinary name.
  std::filesystem::copy_file(folder / "a.nc", folder / "a.nc#mode=zarr");
  std::filesystem::create_symlink(folder / "a.nc#mode=zarr", folder / "innocent.nc");
  for (const char* name : {"a.nc#mode=zarr", "innocent.nc"}) {
    auto source = open_file(folder / name);
    ASSERT_TRUE(source) << source.error().message;
    EXPECT_EQ((*source)->info().format, "netCDF classic");
    auto volume = (*source)->read(0, 1);
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->values[0], 61);  // written as 1, 2, 3, ...; a step has 60 samples
    EXPECT_EQ(volume->values[59], 120);
  }
}

TEST(NetcdfRefusals, FilesWithoutFields) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "line.nc");
    file.variable("f", NC_FLOAT, {file.axis("lat", {0, 1, 2}, "degrees_north")}, {1, 2, 3});
  }
  expect_refused(folder / "line.nc", ErrorKind::bad_data, "no numeric variable");
  { NetcdfMaker file(folder / "bare.nc", 0); }
  expect_refused(folder / "bare.nc", ErrorKind::bad_data, "no numeric variable");
}

TEST(NetcdfRefusals, OversizeGridsAreRefusedBeforeAllocation) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "vast.nc");  // 10^12 samples that were never written, in a small file
    const int z = file.dimension("z", 10000);
    const int y = file.dimension("y", 10000);
    const int x = file.dimension("x", 10000);
    const int f = file.variable("f", NC_DOUBLE, {z, y, x});
    file.chunk(f, {1, 100, 100});
  }
  ASSERT_LT(std::filesystem::file_size(folder / "vast.nc"), 1'000'000U);
  expect_refused(folder / "vast.nc", ErrorKind::bad_data, "more than 68719476736 samples");
  {
    NetcdfMaker file(folder / "long.nc");
    const int y = file.dimension("y", 2);
    const int x = file.dimension("x", 1000000000);
    file.chunk(file.variable("f", NC_BYTE, {y, x}), {1, 1000});
  }
  expect_refused(folder / "long.nc", ErrorKind::bad_data,
                 "'x' has 1000000000 entries, more than the");
}

// A file truncated at any relevant length either opens and gives the values of the whole file, or
// is refused: no zeros, no crash.
void cut_everywhere(int mode, const std::vector<std::size_t>& lengths_to_keep_back, bool all) {
  const Folder folder;
  write_good(folder / "whole.nc", mode);
  const std::string whole = bytes_of(folder / "whole.nc");
  auto original = open_file(folder / "whole.nc");
  ASSERT_TRUE(original) << original.error().message;
  auto expected = (*original)->read(0, 1);
  ASSERT_TRUE(expected);

  std::vector<std::size_t> lengths;
  for (std::size_t n = 0; all && n < whole.size(); ++n) {
    lengths.push_back(n);
  }
  for (const std::size_t back : lengths_to_keep_back) {
    lengths.push_back(whole.size() - std::min(back, whole.size()));
  }
  int refused = 0;
  for (const std::size_t length : lengths) {
    write_bytes(folder / "cut.nc", whole.substr(0, length));
    auto source = open_file(folder / "cut.nc");
    if (!source) {
      EXPECT_EQ(source.error().kind, ErrorKind::bad_data) << length;
      ++refused;
      continue;
    }
    auto volume = (*source)->read(0, 1);
    ASSERT_TRUE(volume) << length << " of " << whole.size();
    ASSERT_EQ(volume->values, expected->values) << length << " of " << whole.size();
  }
  // Only padding after the last value can be missing without loss: at most three bytes.
  EXPECT_GE(refused, static_cast<int>(lengths.size()) - 3);
  EXPECT_GT(refused, 0);
}

TEST(NetcdfRefusals, ClassicFileTruncatedAtEveryByte) {
  for (const int mode : {0, NC_64BIT_OFFSET, NC_64BIT_DATA}) {
    cut_everywhere(mode, {}, true);
  }
}

TEST(NetcdfRefusals, Netcdf4FileTruncatedAtManyPlaces) {
  std::vector<std::size_t> back;
  for (std::size_t n = 1; n < 200; ++n) {
    back.push_back(n);
  }
  for (std::size_t n = 200; n < 30000; n += 97) {
    back.push_back(n);
  }
  cut_everywhere(NC_NETCDF4, back, false);
}

TEST(NetcdfRefusals, TruncatedClassicFileIsReportedWithBothSizes) {
  const Folder folder;
  write_good(folder / "whole.nc", 0);
  const std::string whole = bytes_of(folder / "whole.nc");
  write_bytes(folder / "cut.nc", whole.substr(0, whole.size() - 100));
  expect_refused(folder / "cut.nc", ErrorKind::bad_data,
                 std::to_string(whole.size() - 100) + " bytes");
}

TEST(NetcdfRefusals, HeaderSizeMatchesFilesOfEveryShape) {
  // Sizes by the rules of the format: records of a single variable are not padded, those of several
  // are; padding after the last value is optional.
  struct Case {
    nc_type type;
    std::size_t columns;
    int variables;
    std::size_t slack;  // bytes at the end of the file, after the last value
  };
  const std::vector<Case> cases{{NC_SHORT, 3, 1, 0}, {NC_BYTE, 5, 1, 0},   {NC_SHORT, 3, 2, 2},
                                {NC_BYTE, 5, 2, 3},  {NC_DOUBLE, 2, 3, 0}, {NC_FLOAT, 7, 2, 0}};
  for (const int mode : {0, NC_64BIT_OFFSET, NC_64BIT_DATA}) {
    for (const Case& shape : cases) {
      const Folder folder;
      {
        NetcdfMaker file(folder / "r.nc", mode);
        const int t = file.dimension("t", NC_UNLIMITED);
        const int x = file.dimension("x", shape.columns);
        for (int v = 0; v < shape.variables; ++v) {
          std::string name("v");
          name += std::to_string(v);
          file.variable(name, shape.type, {t, x}, counting(3 * shape.columns));
        }
      }
      const std::string bytes = bytes_of(folder / "r.nc");
      const auto read = [&](std::uint64_t offset, std::size_t count, unsigned char* out) {
        if (offset + count > bytes.size()) {
          return false;
        }
        std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(offset), count, out);
        return true;
      };
      const auto expected = netcdf::classic_bytes_expected(read, bytes.size());
      ASSERT_TRUE(expected) << expected.error().message;
      EXPECT_LE(*expected, bytes.size());
      EXPECT_LE(bytes.size() - *expected, shape.slack);
    }
  }
}

TEST(NetcdfRefusals, CorruptClassicHeaderNeverCrashes) {
  // Every header byte takes one of four values in turn, and every byte of the first 64 all of them;
  // a file that opens must be readable or refused. The fuzzer tries many more.
  const Folder folder;
  write_good(folder / "good.nc", 0);
  const std::string good = bytes_of(folder / "good.nc");
  constexpr std::array corrupt{'\x00', '\x01', '\x7f', '\xff'};
  int refused = 0;
  for (std::size_t at = 4; at < std::min<std::size_t>(good.size(), 700); ++at) {
    for (std::size_t n = 0; n < corrupt.size(); ++n) {
      if (at >= 64 && at % corrupt.size() != n) continue;
      std::string bad = good;
      bad[at] = corrupt.at(n);
      write_bytes(folder / "bad.nc", bad);
      auto source = open_file(folder / "bad.nc");
      if (!source) {
        EXPECT_EQ(source.error().kind, ErrorKind::bad_data);
        ++refused;
        continue;
      }
      auto volume = (*source)->read(0, 0);
      if (volume) {
        EXPECT_EQ(volume->values.size(),
                  (*source)->info().grid.samples() * static_cast<std::size_t>(volume->components));
      }
    }
  }
  EXPECT_GT(refused, 40);
}

TEST(NetcdfRefusals, FileTruncatedWhileOpenIsNotReadAsZeros) {
  for (const int mode : {0, NC_NETCDF4}) {
    const Folder folder;
    write_good(folder / "f.nc", mode);
    auto source = open_file(folder / "f.nc");
    ASSERT_TRUE(source) << source.error().message;
    std::filesystem::resize_file(folder / "f.nc", 300);
    auto volume = (*source)->read(0, 0);
    ASSERT_FALSE(volume);
    EXPECT_EQ(volume.error().kind, ErrorKind::bad_data);
    EXPECT_NE(volume.error().message.find("changed"), std::string::npos);
  }
}

TEST(NetcdfRefusals, ReplacedFileStillGivesItsOldValues) {
  for (const int mode : {0, NC_NETCDF4}) {
    const Folder folder;
    write_good(folder / "f.nc", mode);
    auto source = open_file(folder / "f.nc");
    ASSERT_TRUE(source) << source.error().message;
    write_bytes(folder / "new.nc", "something else");
    std::filesystem::rename(folder / "new.nc", folder / "f.nc");
    auto volume = (*source)->read(0, 1);
    ASSERT_TRUE(volume) << volume.error().message;
    // The first value of the last record in the file is 61; its first level is the bottom.
    EXPECT_EQ(volume->values[0], 61.0F);
  }
}

TEST(NetcdfRefusals, DigestFollowsContentNotPath) {
  const Folder folder;
  write_good(folder / "a.nc", 0);
  std::filesystem::create_directory(folder / "sub");
  std::filesystem::copy_file(folder / "a.nc", folder / "sub/a.nc");
  const auto time = std::filesystem::last_write_time(folder / "a.nc");
  std::filesystem::last_write_time(folder / "sub/a.nc", time);
  const auto digest = [](const std::string& path) {
    auto source = open_file(path);
    EXPECT_TRUE(source);
    return source ? (*source)->info().digest : "";
  };
  EXPECT_EQ(digest(folder / "a.nc"), digest(folder / "sub/a.nc"));
  std::filesystem::last_write_time(folder / "sub/a.nc", time + std::chrono::milliseconds(1));
  EXPECT_NE(digest(folder / "a.nc"), digest(folder / "sub/a.nc"));
}

// An array of azimuths and ranges would be drawn as a rectangle.
TEST(RadarFiles, ValuesAlongRaysAreLeftOutWithTheReason) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "sweep.nc");
    const int azimuth = file.axis("azimuth", counting(36), "degrees", "ray_azimuth_angle");
    const int range = file.axis("range", counting(20), "m", "projection_range_coordinate");
    file.variable("DBZ", NC_FLOAT, {azimuth, range}, counting(720));
  }
  EXPECT_NE(refusal(folder / "sweep.nc").find("polar coordinates are not supported"),
            std::string::npos);
}

TEST(RadarFiles, FilesOfOdimAreRefusedByTheirConvention) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "volume.h5");
    file.text(NC_GLOBAL, "Conventions", "ODIM_H5/V2_2");
    const int rays = file.dimension("rays", 36);
    const int bins = file.dimension("bins", 20);
    file.variable("data", NC_UBYTE, {rays, bins}, std::vector<double>(720, 7));
  }
  EXPECT_NE(refusal(folder / "volume.h5").find("radar data of the convention 'ODIM_H5/V2_2'"),
            std::string::npos);
}

}  // namespace
}  // namespace windsplat::data::test
