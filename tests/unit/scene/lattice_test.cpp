// Sample positions: closed forms of placement, proportion and scale.
#include "server/scene/lattice.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using data::AxisKind;
using protocol::GeometryView;
using protocol::VerticalPlacement;

data::Grid metres(std::vector<double> x, std::vector<double> y, std::vector<double> z) {
  data::Grid grid;
  grid.axes = {axis(AxisKind::cartesian, "m", std::move(x)),
               axis(AxisKind::cartesian, "m", std::move(y)),
               axis(AxisKind::cartesian, "m", std::move(z))};
  return grid;
}

TEST(Lattice, EvenAxesExtendHalfACellBeyondTheirSamples) {
  const auto lattice = place_lattice(metres({0, 1, 2, 3}, {0, 1}, {0, 1}), GeometryView{});
  ASSERT_TRUE(lattice);
  // Four cells make the longest edge 2, so a cell is 0.5.
  EXPECT_EQ(lattice->dims, (std::array<int, 3>{4, 2, 2}));
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(lattice->positions[0][i], -0.75 + 0.5 * static_cast<double>(i), 1e-14);
    EXPECT_NEAR(lattice->spacing[0][i], 0.5, 1e-14);
  }
  EXPECT_NEAR(lattice->positions[1][1], 0.25, 1e-14);
  EXPECT_NEAR(lattice->box_max.x, 1.0, 1e-14);
  EXPECT_NEAR(lattice->box_min.y, -0.5, 1e-14);
  EXPECT_NEAR(lattice->box_max.z, 0.5, 1e-14);
}

TEST(Lattice, UnevenAxesKeepTheirPositionsAndMeetMidway) {
  const auto lattice = place_lattice(metres({0, 1, 3, 7}, {0, 1}, {0, 1}), GeometryView{});
  ASSERT_TRUE(lattice);
  // Edges -0.5, 0.5, 2, 5, 9: 9.5 long, centred on 4.25.
  const double scale = 2.0 / 9.5;
  const std::array<double, 4> at = {0, 1, 3, 7};
  const std::array<double, 4> width = {1, 1.5, 3, 4};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(lattice->positions[0][i], (at[i] - 4.25) * scale, 1e-14);
    EXPECT_NEAR(lattice->spacing[0][i], width[i] * scale, 1e-14);
  }
}

TEST(Lattice, SingleLayerIsPlacedAtAnyCoordinate) {
  const auto lattice = place_lattice(metres({0, 1, 2}, {0, 1, 2}, {1e17}), GeometryView{});
  ASSERT_TRUE(lattice) << lattice.error().message;
  EXPECT_EQ(lattice->positions[2], std::vector<double>{0});
  EXPECT_NEAR(lattice->spacing[2][0], lattice->spacing[0][0], 1e-14);
}

TEST(Lattice, PressuresWithEqualLogarithmsAreRefused) {
  data::Grid grid = metres({0, 1, 2}, {0, 1, 2}, {});
  // 16 units in the last place apart; after the logarithm one or none remains.
  grid.axes[2] = axis(AxisKind::pressure, "Pa", {1e5 + 4.4e-10, 1e5 + 2.2e-10, 1e5});
  const auto lattice = place_lattice(grid, GeometryView{});
  ASSERT_FALSE(lattice);
  EXPECT_EQ(lattice.error().kind, ErrorKind::bad_data);
}

TEST(Lattice, PressureIsPlacedByLogarithmWithLowPressureHigh) {
  const auto lattice = place_lattice(atmosphere_grid(), GeometryView{});
  ASSERT_TRUE(lattice);
  // ln 2 apart each: three equal cells, in a box of 0.15 of the longest horizontal edge.
  EXPECT_NEAR(lattice->box_max.z - lattice->box_min.z, 0.15 * 2.0, 1e-14);
  EXPECT_NEAR(lattice->positions[2][0], -0.1, 1e-14);
  EXPECT_NEAR(lattice->positions[2][1], 0.0, 1e-14);
  EXPECT_NEAR(lattice->positions[2][2], 0.1, 1e-14);
}

TEST(Lattice, VerticalPlacementIsConfigurable) {
  GeometryView geometry;
  geometry.vertical = VerticalPlacement::linear;
  auto lattice = place_lattice(atmosphere_grid(), geometry);
  ASSERT_TRUE(lattice);
  // With pressure itself as coordinate: cells of 500, 375, 250 hPa, 1125 in total, in 0.3.
  EXPECT_NEAR(lattice->spacing[2][0], 0.3 * 500 / 1125, 1e-14);
  EXPECT_NEAR(lattice->spacing[2][1], 0.3 * 375 / 1125, 1e-14);
  EXPECT_NEAR(lattice->positions[2][1] - lattice->positions[2][0], 0.3 * 500 / 1125, 1e-14);
  geometry.vertical = VerticalPlacement::index;
  data::Grid grid = atmosphere_grid();
  grid.axes[2].coordinates = {1000, 10, 1};
  lattice = place_lattice(grid, geometry);
  ASSERT_TRUE(lattice);
  EXPECT_NEAR(lattice->positions[2][0], -0.1, 1e-14);
  EXPECT_NEAR(lattice->positions[2][2], 0.1, 1e-14);
}

TEST(Lattice, LogPressureNeedsPressures) {
  GeometryView geometry;
  geometry.vertical = VerticalPlacement::logp;
  EXPECT_TRUE(place_lattice(atmosphere_grid(), geometry));
  const auto refused = place_lattice(metres({0, 1}, {0, 1}, {1, 2}), geometry);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  EXPECT_EQ(refused.error().at.at(0).pointer, "/geometry/vertical");
  data::Grid vacuum = atmosphere_grid();
  vacuum.axes[2].coordinates = {1000, 500, 0};
  EXPECT_FALSE(place_lattice(vacuum, geometry));
  EXPECT_TRUE(place_lattice(vacuum, GeometryView{}));  // auto: log p cannot represent zero
}

TEST(Lattice, DepthGrowsDownwards) {
  data::Grid grid = atmosphere_grid();
  grid.axes[2] = axis(AxisKind::depth, "m", {100, 50, 0});
  const auto lattice = place_lattice(grid, GeometryView{});
  ASSERT_TRUE(lattice);
  EXPECT_NEAR(lattice->positions[2][0], -0.1, 1e-14);
  EXPECT_NEAR(lattice->positions[2][2], 0.1, 1e-14);
}

TEST(Lattice, LongitudeAndLatitudeShareTheirUnit) {
  const auto lattice = place_lattice(atmosphere_grid(), GeometryView{});
  ASSERT_TRUE(lattice);
  EXPECT_NEAR(lattice->box_max.x, 1.0, 1e-14);   // 40 degrees
  EXPECT_NEAR(lattice->box_max.y, 0.75, 1e-14);  // 30 degrees
}

data::Grid map_of(std::vector<double> longitudes, std::vector<double> latitudes) {
  data::Grid grid;
  grid.axes = {axis(AxisKind::longitude, "degrees_east", std::move(longitudes)),
               axis(AxisKind::latitude, "degrees_north", std::move(latitudes)),
               axis(AxisKind::height, "m", {0, 1000})};
  return grid;
}

double width_to_height(const Lattice& lattice) {
  return (lattice.box_max.x - lattice.box_min.x) / (lattice.box_max.y - lattice.box_min.y);
}

// cos(60 degrees) = 1/2.
TEST(Lattice, RegionalMapIsTrueToScaleInItsMiddle) {
  const auto lattice = place_lattice(map_of({0, 5, 10}, {55, 60, 65}), GeometryView{});
  ASSERT_TRUE(lattice);
  EXPECT_NEAR(width_to_height(*lattice), 0.5, 1e-14);
  EXPECT_NEAR(lattice->box_max.y, 1.0, 1e-14);
  EXPECT_NEAR(lattice->box_max.z - lattice->box_min.z, 0.15 * 2, 1e-14);
  const auto south = place_lattice(map_of({0, 5, 10}, {-65, -60, -55}), GeometryView{});
  ASSERT_TRUE(south);
  EXPECT_NEAR(width_to_height(*south), 0.5, 1e-14);
}

TEST(Lattice, MapsAroundTheGlobeAndBeyondNinetyDegreesOfLatitudeArePlateCarree) {
  std::vector<double> around;
  for (int i = 0; i < 36; ++i) around.push_back(10.0 * i);
  const auto ring = place_lattice(map_of(around, {55, 60, 65}), GeometryView{});
  ASSERT_TRUE(ring);
  EXPECT_NEAR(width_to_height(*ring), 360.0 / 15, 1e-12);
  around.pop_back();
  const auto open_ring = place_lattice(map_of(around, {55, 60, 65}), GeometryView{});
  ASSERT_TRUE(open_ring);
  EXPECT_NEAR(width_to_height(*open_ring), 350.0 / 15, 1e-12);
  around.resize(26);
  const auto part = place_lattice(map_of(around, {55, 60, 65}), GeometryView{});
  ASSERT_TRUE(part);
  EXPECT_NEAR(width_to_height(*part), 0.5 * 260.0 / 15, 1e-12);
  const auto tall = place_lattice(map_of({0, 5, 10}, {-10, 25, 60}), GeometryView{});
  ASSERT_TRUE(tall);
  EXPECT_NEAR(width_to_height(*tall), 15.0 / 105, 1e-14);
}

TEST(Lattice, FlatBoxOfLengthsIsExaggeratedLikeThatOfDegrees) {
  // 1000 km x 1000 km x 10 km, and a box of a twentieth, which keeps its proportions.
  const std::vector<double> wide = {0, 500000};
  const auto flat = place_lattice(metres(wide, wide, {0, 5000}), GeometryView{});
  ASSERT_TRUE(flat);
  EXPECT_NEAR(flat->box_max.z - flat->box_min.z, 0.15 * 2, 1e-14);
  EXPECT_NEAR(*vertical_exaggeration(metres(wide, wide, {0, 5000}), *flat), 15, 1e-12);
  const data::Grid thick = metres(wide, wide, {0, 25000});
  const auto kept = place_lattice(thick, GeometryView{});
  ASSERT_TRUE(kept);
  EXPECT_NEAR(kept->box_max.z - kept->box_min.z, 0.05 * 2, 1e-14);
  EXPECT_NEAR(*vertical_exaggeration(thick, *kept), 1, 1e-12);
}

TEST(Lattice, LengthsInDifferentUnitsKeepTheirProportion) {
  data::Grid grid = metres({0, 1}, {0, 2000}, {0, 500});
  grid.axes[0].units = "km";
  const auto lattice = place_lattice(grid, GeometryView{});
  ASSERT_TRUE(lattice);
  EXPECT_NEAR(width_to_height(*lattice), 0.5, 1e-14);
  EXPECT_NEAR(lattice->box_max.z - lattice->box_min.z, 0.5, 1e-14);
}

TEST(Lattice, VerticalAxisIsToScaleOnRequest) {
  GeometryView geometry;
  geometry.vertical = VerticalPlacement::metric;
  const std::vector<double> wide = {0, 500000};
  const auto flat = place_lattice(metres(wide, wide, {0, 5000}), geometry);
  ASSERT_TRUE(flat);
  EXPECT_NEAR(flat->box_max.z - flat->box_min.z, 0.01 * 2, 1e-14);
  const data::Grid map = map_of({0, 5, 10}, {55, 60, 65});
  const auto placed = place_lattice(map, geometry);
  ASSERT_TRUE(placed);
  // 2 km over 15 degrees of 111.19 km.
  EXPECT_NEAR(placed->box_max.z - placed->box_min.z, 2 * 2 / (15 * 111.194926645), 1e-9);
  EXPECT_NEAR(*vertical_exaggeration(map, *placed), 1, 1e-12);
  // A section along 60 N, where a degree of longitude has half the length.
  const auto section = place_lattice(map_of({0, 5, 10}, {60}), geometry);
  ASSERT_TRUE(section);
  EXPECT_NEAR((section->box_max.z - section->box_min.z) / (section->box_max.x - section->box_min.x),
              2 / (7.5 * 111.194926645), 1e-12);
  const auto refused = place_lattice(atmosphere_grid(), geometry);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().at.at(0).pointer, "/geometry/vertical");
}

// 1000 hPa lie at 110.8 m and 250 hPa at 10363 m of the ICAO standard atmosphere (Doc 7488).
TEST(Lattice, PressuresAreExaggeratedByTheStandardAtmosphere) {
  const data::Grid grid = atmosphere_grid();
  const auto lattice = place_lattice(grid, {});
  ASSERT_TRUE(lattice);
  const double up = lattice->positions[2].back() - lattice->positions[2].front();
  const double north = lattice->positions[1].back() - lattice->positions[1].front();
  const auto times = vertical_exaggeration(grid, *lattice);
  ASSERT_TRUE(times);
  EXPECT_NEAR(*times, (up / (10363 - 110.8)) / (north / (20 * 111194.93)), 0.001 * *times);
  data::Grid levels = grid;
  levels.axes[2].kind = data::AxisKind::level;
  EXPECT_FALSE(vertical_exaggeration(levels, *place_lattice(levels, {})));
}

// Rows and columns without units, 3 km apart in both directions at 60 N, below 10 km: WRF.
TEST(Lattice, RowsAreToTheScaleOfTheirPositions) {
  data::Grid grid = metres({0, 1, 2, 3}, {0, 1, 2}, {0, 5000, 10000});
  grid.axes[0].units = grid.axes[1].units = "";
  data::Columns columns;
  const double north = 3000 / 111194.93;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 4; ++i) {
      columns.latitude.push_back(60 + j * north);
      columns.longitude.push_back(179.98 + i * 2 * north - (i > 0 ? 360 : 0));
    }
  }
  grid.columns = std::make_shared<const data::Columns>(columns);
  const auto lattice = place_lattice(grid, {});
  ASSERT_TRUE(lattice);
  const double up = lattice->positions[2].back() - lattice->positions[2].front();
  const double across = lattice->positions[1].back() - lattice->positions[1].front();
  EXPECT_NEAR(vertical_exaggeration(grid, *lattice).value_or(0), (up / 10000) / (across / 6000),
              1e-6);
  data::Grid section = grid;
  section.axes[1].coordinates = {0};
  columns.latitude.resize(4);
  columns.longitude.resize(4);
  section.columns = std::make_shared<const data::Columns>(columns);
  const auto row = place_lattice(section, {});
  ASSERT_TRUE(row);
  const double along = row->positions[0].back() - row->positions[0].front();
  const double rise = row->positions[2].back() - row->positions[2].front();
  EXPECT_NEAR(vertical_exaggeration(section, *row).value_or(0), (rise / 10000) / (along / 9000),
              1e-4);
}

TEST(Lattice, DimensionOfOneIsOneCellThick) {
  auto lattice = place_lattice(metres({0, 1, 3, 7}, {0, 2}, {5}), GeometryView{});
  ASSERT_TRUE(lattice);
  // The smallest cell of the other axes is 1 m of 9.5 m.
  EXPECT_NEAR(lattice->spacing[2].at(0), 1.0 * 2.0 / 9.5, 1e-14);
  EXPECT_NEAR(lattice->positions[2].at(0), 0.0, 1e-14);
  EXPECT_NEAR(lattice->box_max.z - lattice->box_min.z, 2.0 / 9.5, 1e-14);
  lattice = place_lattice(metres({3}, {4}, {5}), GeometryView{});
  ASSERT_TRUE(lattice);
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(lattice->box_max[a] - lattice->box_min[a], 2.0, 1e-14);
  }
}

TEST(Lattice, ScaleMultipliesBeforeTheLongestEdgeIsSetToTwo) {
  GeometryView geometry;
  geometry.scale = {1, 1, 10};
  const auto lattice = place_lattice(atmosphere_grid(), geometry);
  ASSERT_TRUE(lattice);
  // 2 x 1.5 x 0.3 becomes 2 x 1.5 x 3, then everything is scaled by 2 / 3.
  EXPECT_NEAR(lattice->box_max.x - lattice->box_min.x, 2.0 * 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(lattice->box_max.y - lattice->box_min.y, 1.5 * 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(lattice->box_max.z - lattice->box_min.z, 2.0, 1e-12);
}

TEST(Lattice, SpacingsAMillionfoldApartStayFinite) {
  const auto lattice =
      place_lattice(metres({0, 1e-3, 1, 2}, {0, 1e-3, 2e-3}, {0, 1, 1e3}), GeometryView{});
  ASSERT_TRUE(lattice);
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t i = 0; i < lattice->spacing[a].size(); ++i) {
      EXPECT_TRUE(std::isfinite(lattice->positions[a][i]));
      EXPECT_GT(lattice->spacing[a][i], 0.0);
    }
  }
  EXPECT_NEAR(lattice->box_max.z - lattice->box_min.z, 2.0, 1e-12);
}

// The engine draws kernels of single precision, with a limit of 1e-7 of the widths of cells.
TEST(Lattice, CellsTooNarrowForSinglePrecisionAreRefused) {
  GeometryView geometry;
  geometry.vertical = VerticalPlacement::metric;
  const auto placed = place_lattice(metres({0, 1, 2}, {0, 1, 2}, {0, 2e-7, 4e-7}), geometry);
  EXPECT_TRUE(placed);
  const auto refused = place_lattice(metres({0, 1, 2}, {0, 1, 2}, {0, 0.5e-7, 1e-7}), geometry);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_data);
  EXPECT_NE(refused.error().message.find("5e-08 times as wide"), std::string::npos)
      << refused.error().message;
  const auto uneven = place_lattice(metres({0, 1e-9, 1, 2}, {0, 1}, {0, 1}), GeometryView{});
  ASSERT_FALSE(uneven);
  EXPECT_EQ(uneven.error().kind, ErrorKind::bad_data);
}

TEST(Lattice, ScaleThatFlattensCellsBeyondTheLimitIsInvalid) {
  GeometryView geometry;
  geometry.scale = {1e3, 1, 1e-3};
  geometry.vertical = VerticalPlacement::metric;
  const auto even = metres({0, 1, 2}, {0, 1, 2}, {0, 1, 2});
  EXPECT_TRUE(place_lattice(even, geometry));
  const auto refused = place_lattice(metres({0, 1, 2}, {0, 1, 2}, {0, 0.05, 0.1}), geometry);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  ASSERT_EQ(refused.error().at.size(), 1U);
  EXPECT_EQ(refused.error().at[0].pointer, "/geometry/scale/2");
  EXPECT_NE(refused.error().message.find("limit of 1e-7"), std::string::npos)
      << refused.error().message;
}

TEST(Lattice, NonMonotonicCoordinatesAreRefused) {
  const auto refused = place_lattice(metres({0, 2, 1}, {0, 1}, {0, 1}), GeometryView{});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_data);
}

}  // namespace
}  // namespace windsplat::scene
