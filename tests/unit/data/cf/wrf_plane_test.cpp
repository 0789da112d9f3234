// Idealised runs of WRF: longitudes and latitudes that are all zero, and the lengths of cells in
// the attributes DX and DY of the file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::ElementsAre;

// U = 3e-3 s-1 * y at the centres of 4 x 3 cells of 1000 m x 500 m, V = 0.
void write_run(const std::string& path, std::size_t records, double map_factor = 1,
               double spacing = 1000) {
  NetcdfMaker file(path);
  file.number(NC_GLOBAL, "DX", NC_FLOAT, {spacing});
  file.number(NC_GLOBAL, "DY", NC_FLOAT, {500});
  const int t = file.dimension("Time", NC_UNLIMITED);
  const int x = file.dimension("west_east", 4);
  const int xs = file.dimension("west_east_stag", 5);
  const int y = file.dimension("south_north", 3);
  const int ys = file.dimension("south_north_stag", 4);
  const int z = file.dimension("bottom_top", 2);
  const int zs = file.dimension("bottom_top_stag", 3);
  const auto put = [&](const std::string& name, std::vector<int> dims, std::size_t values,
                       const auto& of, const std::string& units) {
    std::vector<double> all;
    for (std::size_t n = 0; n < values * records; ++n) all.push_back(of(n % values));
    dims.insert(dims.begin(), t);
    file.text(file.variable(name, NC_FLOAT, dims, all), "units", units);
  };
  const auto zero = [](std::size_t) { return 0.0; };
  put("XLAT", {y, x}, 12, zero, "degree_north");
  put("XLONG", {y, x}, 12, zero, "degree_east");
  put(
      "MAPFAC_M", {y, x}, 12, [&](std::size_t) { return map_factor; }, "");
  put(
      "U", {z, y, xs}, 30,
      [](std::size_t n) { return 3e-3 * 500 * static_cast<double>(n / 5 % 3); }, "m s-1");
  put("V", {z, ys, x}, 32, zero, "m s-1");
  put("W", {zs, y, x}, 36, zero, "m s-1");
  put("PH", {zs, y, x}, 36, zero, "m2 s-2");
  put(
      "PHB", {zs, y, x}, 36, [](std::size_t n) { return 9810 * static_cast<double>(n / 12); },
      "m2 s-2");
}

TEST(WrfPlane, CellsHaveTheLengthsOfTheFile) {
  const Folder folder;
  write_run(folder / "wrfout.nc", 1);
  const auto source = opened(folder / "wrfout.nc");
  const DatasetInfo& info = source->info();
  EXPECT_THAT(info.grid.axes[0].coordinates, ElementsAre(0, 1000, 2000, 3000));
  EXPECT_THAT(info.grid.axes[1].coordinates, ElementsAre(0, 500, 1000));
  EXPECT_EQ(info.grid.axes[0].units, "m");
  EXPECT_TRUE(has_note(info, "placed by DX = 1000 m and DY = 500 m"));
  EXPECT_EQ(reason_of(info, "west_east"), "");
  // dv/dx - du/dy
  for (const float value : volume_of(*source, "wind_vertical_vorticity").values) {
    EXPECT_NEAR(value, -3e-3, 1e-8);
  }
}

TEST(WrfPlane, LengthsOfADistortedMapAreNotUsed) {
  const Folder folder;
  write_run(folder / "wrfout.nc", 1, 1.05);
  const auto source = opened(folder / "wrfout.nc");
  EXPECT_THAT(source->info().grid.axes[0].coordinates, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(source->info().grid.axes[0].units, "");
  EXPECT_TRUE(has_note(source->info(), "'MAPFAC_M' differs from 1"));
}

TEST(WrfPlane, LengthsThatAreNoneAreIgnored) {
  const Folder folder;
  for (const double spacing : {0.0, -1.0}) {
    write_run(folder / "wrfout.nc", 1, 1, spacing);
    EXPECT_EQ(opened(folder / "wrfout.nc")->info().grid.axes[0].units, "") << spacing;
  }
}

// WRF writes such a file when a run starts.
TEST(WrfPlane, FilesWithoutARecordAreLeftOutOfTheirSeries) {
  const Folder folder;
  write_run(folder / "wrfout_1.nc", 0);
  write_run(folder / "wrfout_2.nc", 2);
  write_run(folder / "wrfout_3.nc", 0);
  const auto source = opened(folder / "wrfout_*.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().steps.size(), 2U);
  EXPECT_TRUE(has_note(source->info(), "2 of 3 files cannot be read"));
  EXPECT_TRUE(has_note(source->info(), "'wrfout_3.nc' has no time step"));
  EXPECT_THAT(refusal(folder / "wrfout_1.nc"), testing::HasSubstr("'Time' of "));
  EXPECT_THAT(refusal(folder / "wrfout_[13].nc"), testing::HasSubstr("has no time step"));
}

}  // namespace
}  // namespace windsplat::data::test
