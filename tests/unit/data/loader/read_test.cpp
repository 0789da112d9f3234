// Reading in a separate process yields the same numbers and the same errors as in this one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "server/data/loader/loader.hpp"
#include "server/data/loader/messages.hpp"
#include "server/data/open/open.hpp"
#include "server/data/resident/store.hpp"
#include "tests/unit/data/loader/loader_fixture.hpp"
#include "tests/unit/data/loader_files.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::loader {
namespace {

using test::NetcdfMaker;
using testing::HasSubstr;

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

// Boxes of other sizes one after the other, and the whole between them.
TEST_F(Loader, BoxesAreCutsOfTheWhole) {
  for (const int mode : {0, NC_NETCDF4}) {
    const std::string path = folder_ / "boxes.nc";
    test::write_wind(path, mode);
    const auto source = opened(path);
    ASSERT_NE(source, nullptr);
    for (std::size_t f = 0; f < source->info().fields.size(); ++f) {
      for (const std::size_t step : {1, 0}) {
        const auto whole = source->read(f, step);
        ASSERT_TRUE(whole) << whole.error().message;
        for (const Box& box : {Box{{1, 0, 0}, {3, 2, 2}}, Box{{3, 2, 1}, {1, 1, 1}},
                               Box{{0, 0, 0}, {4, 3, 2}}, Box{{0, 1, 0}, {2, 1, 2}}}) {
          const auto part = source->read_part(f, step, {box});
          ASSERT_TRUE(part) << part.error().message;
          expect_same(*part, cut(*whole, box));
        }
      }
    }
  }
}

TEST_F(Loader, Netcdf4FilesReadAsInThisProcess) {
  const std::string path = folder_ / "four.nc";
  test::write_wind(path, NC_NETCDF4);
  expect_same_as_here(path);
}

// SQLite opens the database by name, which the daemon does for the loader.
TEST_F(Loader, SystemsOfTheDatabaseOfProjAreThoseOfThisProcess) {
  const std::string path = folder_ / "epsg.nc";
  {
    NetcdfMaker file(path);
    const int y = file.axis("y", {5.1e6, 5.2e6}, "m", "projection_y_coordinate");
    const int x = file.axis("x", {4e5, 5e5}, "m", "projection_x_coordinate");
    file.text(file.variable("f", NC_FLOAT, {y, x}, {1, 2, 3, 4}), "crs", "EPSG:32633");
  }
  expect_same_as_here(path);
  const auto there = opened(path);
  ASSERT_NE(there, nullptr);
  ASSERT_NE(there->info().grid.columns, nullptr);
  Limits without;
  without.library_folders.clear();
  const auto lost = opened(path, without);
  ASSERT_NE(lost, nullptr);
  ASSERT_FALSE(lost->info().notes.empty());
  EXPECT_THAT(lost->info().notes[0], HasSubstr("the database of PROJ is not installed"));
}

// PROJ looks for files, none of which a loader can open.
TEST_F(Loader, PositionsOfMapProjectionsAreThoseOfThisProcess) {
  for (const bool transverse : {false, true}) {
    const std::string path = folder_ / "map.nc";
    {
      NetcdfMaker file(path);
      const int y = file.axis("y", {1e5, 2e5, 3e5}, "m", "projection_y_coordinate");
      const int x = file.axis("x", {1e5, 2e5}, "m", "projection_x_coordinate");
      const int crs = file.variable("crs", NC_INT, {}, {0});
      file.text(crs, "grid_mapping_name",
                transverse ? "transverse_mercator" : "lambert_conformal_conic");
      file.number(crs, "standard_parallel", NC_DOUBLE, {38.5});
      file.number(crs, "scale_factor_at_central_meridian", NC_DOUBLE, {1});
      file.number(crs, "latitude_of_projection_origin", NC_DOUBLE, {38.5});
      file.number(crs, "longitude_of_central_meridian", NC_DOUBLE, {-97.5});
      file.text(file.variable("f", NC_FLOAT, {y, x}, test::counting(6)), "grid_mapping", "crs");
    }
    expect_same_as_here(path);
    EXPECT_NE(opened(path)->info().grid.columns, nullptr);
  }
}

// Chunks that were never written, in a file that disables filling: HDF5 leaves the memory
// unchanged, which contained the numbers of another field. They must be masked.
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

// A loader may have 256 files open besides the members of a series; each step has 320 pieces, which
// the daemon opens.
TEST_F(Loader, MorePiecesThanDescriptorsReadAsInThisProcess) {
  constexpr int pieces = 320;
  for (const int step : {1, 2}) {
    std::filesystem::create_directories(folder_ / "parts");
    std::string listed;
    for (int n = 0; n < pieces; ++n) {
      const std::string extent = std::to_string(n) + ' ' + std::to_string(n + 1) + " 0 1 0 1";
      const std::string name = "parts/" + std::to_string(step) + '_' + std::to_string(n) + ".vti";
      std::ofstream(folder_ / name)
          << "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"" << extent
          << "\"><Piece Extent=\"" << extent
          << "\"><PointData><DataArray type=\"Float32\" Name=\"a\" format=\"ascii\">" << n << ' '
          << n + 1 << " 0 0 0 0 0 " << step
          << "</DataArray></PointData></Piece></ImageData></VTKFile>";
      listed += "<Piece Source=\"" + name + "\" Extent=\"" + extent + "\"/>";
    }
    std::ofstream(folder_ / ("s" + std::to_string(step) + ".pvti"))
        << "<VTKFile type=\"PImageData\"><PImageData WholeExtent=\"0 " << pieces
        << " 0 1 0 1\"><PPointData><PDataArray type=\"Float32\" Name=\"a\"/></PPointData>" << listed
        << "</PImageData></VTKFile>";
  }
  expect_same_as_here(folder_ / "s*.pvti");
  auto source = opened(folder_ / "s*.pvti");
  ASSERT_TRUE(source);
  const auto volume = source->read(0, 1);
  ASSERT_TRUE(volume) << volume.error().message;
  for (const std::size_t n : {0U, 100U, 319U, 320U}) {
    EXPECT_EQ(volume->values[n], static_cast<float>(n));
  }
  EXPECT_EQ(volume->values[volume->samples() - 1], 2);
}

// Number of descriptors of this process that refer to the memory of volumes.
std::size_t transfers_kept() {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code closed;
    const auto target = std::filesystem::read_symlink(entry.path(), closed).native();
    count += target.find("windsplat-volume") != std::string::npos ? 1 : 0;
  }
  return count;
}

// MiB of shared memory that another process has mapped and that is resident, if the system reports
// it.
double shared_by(pid_t id) {
  std::ifstream file("/proc/" + std::to_string(id) + "/status");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("RssShmem:")) return std::stod(line.substr(9)) / 1024;
  }
  return 0;
}

// A scalar of 12 MiB and a vector of 35 MiB pass through one window.
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
    EXPECT_EQ(transfers_kept(), 1U);
    EXPECT_LT(shared_by(source->process()), 5);
  }
}

// Files that a header refers to are part of the dataset.
TEST_F(Loader, ChangedCompanionFileIsDetected) {
  std::ofstream(folder_ / "c.json")
      << R"({"windsplat": "raw", "file": "c.raw", "type": "float32", "endian": "little",
             "dims": {"x": 4, "y": 4, "z": 4}, "fields": [{"name": "cloud"}]})";
  test::write_floats(folder_ / "c.raw", 64, 1);
  Store store({1 << 20, Storage::float32,
               [](const Location& location, const CancelToken&) -> Result<std::unique_ptr<Source>> {
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
    source->release();  // and so does the next loader
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
  std::ofstream(path) << "not a dataset, despite its name";
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

}  // namespace
}  // namespace windsplat::data::loader
