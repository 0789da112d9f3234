// Coordinates in degrees that count the cells of a tile, as FV3 writes them.
#include "server/data/cf/selected/index_axes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::tiles {
namespace {

constexpr std::size_t cells = 12;  // along each side

std::vector<double> counted(std::size_t length, double first = 1) {
  std::vector<double> out;
  for (std::size_t n = 0; n < length; ++n) out.push_back(first + static_cast<double>(n));
  return out;
}

struct Grid2D {
  int x = -1;
  int y = -1;
};

Grid2D add_axes(NetcdfMaker& file, const std::string& x, const std::string& y,
                const std::vector<double>& east, const std::vector<double>& north) {
  Grid2D out;
  out.y = file.axis(y, north, "degrees_N");
  out.x = file.axis(x, east, "degrees_E");
  return out;
}

std::vector<double> numbered(std::size_t count) { return counted(count, 0); }

// Positions of the tile of a gnomonic cube around (0 E, 0 N), with equal angles.
std::vector<double> position_on_tile(bool east) {
  std::vector<double> out;
  const auto tangent = [](std::size_t n) {
    return std::tan((((static_cast<double>(n) + 0.5) / cells) - 0.5) * std::numbers::pi / 2);
  };
  for (std::size_t j = 0; j < cells; ++j) {
    for (std::size_t i = 0; i < cells; ++i) {
      const double x = tangent(i);
      const double y = tangent(j);
      out.push_back((east ? std::atan(x) : std::atan2(y, std::hypot(1, x))) / degree);
    }
  }
  return out;
}

void add_positions(NetcdfMaker& file, const Grid2D& grid) {
  for (const bool east : {true, false}) {
    const int id = file.variable(east ? "grid_lont" : "grid_latt", NC_DOUBLE, {grid.y, grid.x},
                                 position_on_tile(east));
    file.text(id, "units", east ? "degrees_E" : "degrees_N");
  }
}

void add_field(NetcdfMaker& file, const Grid2D& grid, std::size_t count) {
  const int id = file.variable("ps", NC_DOUBLE, {grid.y, grid.x}, numbered(count));
  file.text(id, "units", "Pa");
}

void expect_on_tile(const DatasetInfo& info) {
  ASSERT_NE(info.grid.columns, nullptr);
  const std::vector<double> east = position_on_tile(true);
  const std::vector<double> north = position_on_tile(false);
  ASSERT_EQ(info.grid.columns->longitude.size(), east.size());
  for (std::size_t n = 0; n < east.size(); ++n) {
    EXPECT_NEAR(info.grid.columns->longitude[n], east[n], 1e-9) << n;
    EXPECT_NEAR(info.grid.columns->latitude[n], north[n], 1e-9) << n;
  }
}

TEST(IndexAxes, CellsOfATileAreNoLongitudes) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "t.nc");
    add_field(file, add_axes(file, "grid_xt", "grid_yt", counted(cells), counted(cells)),
              cells * cells);
  }
  const auto source = opened(folder / "t.nc");
  ASSERT_NE(source, nullptr);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.grid.axes[0].kind, AxisKind::cartesian);
  EXPECT_EQ(info.grid.axes[1].kind, AxisKind::cartesian);
  EXPECT_EQ(info.grid.axes[0].units, "");
  EXPECT_TRUE(has_note(info, "'grid_xt' and 'grid_yt' only count columns and rows"));
  // Columns remain those of the file: x is the fast dimension.
  const Volume volume = volume_of(*source, "ps");
  ASSERT_EQ(volume.values.size(), cells * cells);
  EXPECT_EQ(volume.values[1], 1.0F);
}

TEST(IndexAxes, PositionsOfTheFilePlaceTheTile) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "t.nc");
    const Grid2D grid = add_axes(file, "grid_xt", "grid_yt", counted(cells), counted(cells));
    add_positions(file, grid);
    add_field(file, grid, cells * cells);
  }
  const auto source = opened(folder / "t.nc");
  ASSERT_NE(source, nullptr);
  expect_on_tile(source->info());
}

TEST(IndexAxes, PositionsOfAJoinedFileOfTheGridPlaceTheTile) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "atmos.nc");
    add_field(file, add_axes(file, "grid_xt", "grid_yt", counted(cells), counted(cells)),
              cells * cells);
    NetcdfMaker grid(folder / "grid_spec.nc");
    add_positions(grid, add_axes(grid, "grid_xt", "grid_yt", counted(cells), counted(cells)));
  }
  for (const char* pattern : {"{atmos,grid_spec}.nc", "{grid_spec,atmos}.nc"}) {
    const auto source = opened(folder / pattern);
    ASSERT_NE(source, nullptr) << pattern;
    expect_on_tile(source->info());
  }
}

TEST(IndexAxes, LatitudesBeyondThePoleAreIndicesWhateverTheirName) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "t.nc");
    add_field(file, add_axes(file, "lon", "lat", counted(96), counted(96)), 96 * 96);
  }
  const auto source = opened(folder / "t.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().grid.axes[0].kind, AxisKind::cartesian);
}

TEST(IndexAxes, TrueLongitudesOfTheSameNamesAreKept) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "r.nc");  // as fregrid writes
    add_field(file, add_axes(file, "grid_xt", "grid_yt", counted(cells, 0.5), counted(cells)),
              cells * cells);
    NetcdfMaker region(folder / "s.nc");  // one degree from (1 E, 1 N)
    add_field(region, add_axes(region, "lon", "lat", counted(40), counted(50)), 40 * 50);
  }
  for (const char* name : {"r.nc", "s.nc"}) {
    const auto source = opened(folder / name);
    ASSERT_NE(source, nullptr) << name;
    EXPECT_EQ(source->info().grid.axes[0].kind, AxisKind::longitude) << name;
    EXPECT_EQ(source->info().grid.axes[1].kind, AxisKind::latitude) << name;
  }
}

}  // namespace
}  // namespace windsplat::data::test::tiles
