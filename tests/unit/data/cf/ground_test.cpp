// The height of the ground of each column: which variable it is, its unit and sign, land and masks.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

const std::vector<double> relief{0, 100, 200, 1500, 2500, -20};  // 2 rows of 3 columns

// A file of two steps with a temperature on heights or depths, to which `add` adds variables on the
// dimensions time, y and x.
std::string file_with(const std::string& path,
                      const std::function<void(NetcdfMaker&, int time, int y, int x)>& add,
                      bool in_water = false) {
  NetcdfMaker made(path);
  const int time = made.axis("time", {0, 1}, "hours since 2000-01-01", "time");
  const int z =
      made.axis(in_water ? "depth" : "altitude", {10, 20}, "m", in_water ? "depth" : "altitude");
  const int y = made.axis("lat", {40, 41}, "degrees_north", "latitude");
  const int x = made.axis("lon", {5, 6, 7}, "degrees_east", "longitude");
  const int t = made.variable("t", NC_FLOAT, {time, z, y, x}, std::vector<double>(24, 280));
  made.text(t, "units", "K");
  add(made, time, y, x);
  made.finish();
  return path;
}

// The ground of a file with one variable `name` on y and x.
std::shared_ptr<const Ground> ground_by(const std::string& path, const std::string& name,
                                        const std::string& units, const std::string& standard_name,
                                        const std::vector<double>& values = relief) {
  const std::string file = file_with(path, [&](NetcdfMaker& made, int, int y, int x) {
    const int v = made.variable(name, NC_DOUBLE, {y, x}, values);
    if (!units.empty()) made.text(v, "units", units);
    if (!standard_name.empty()) made.text(v, "standard_name", standard_name);
  });
  return opened(file)->info().grid.ground;
}

void expect_heights(const Ground& ground, const std::vector<double>& expected) {
  ASSERT_EQ(ground.heights.size(), expected.size());
  for (std::size_t n = 0; n < expected.size(); ++n) {
    const auto height = static_cast<double>(ground.heights[n]);
    if (std::isnan(expected[n])) {
      EXPECT_TRUE(std::isnan(height)) << n;
    } else {
      EXPECT_NEAR(height, expected[n], 1e-6 * std::abs(expected[n])) << n;
    }
  }
}

TEST(GroundOfAFile, IsASurfaceAltitudeInMetres) {
  Folder folder;
  const auto metres = ground_by(folder / "m.nc", "zs", "m", "surface_altitude");
  ASSERT_TRUE(metres);
  EXPECT_EQ(metres->name, "zs");
  EXPECT_EQ(metres->kind, GroundKind::land);
  expect_heights(*metres, relief);
  std::vector<double> in_km = relief;
  for (double& z : in_km) z /= 1000;
  const auto kilometres = ground_by(folder / "km.nc", "zs", "km", "surface_altitude", in_km);
  ASSERT_TRUE(kilometres);
  expect_heights(*kilometres, relief);
}

TEST(GroundOfAFile, OfASurfaceGeopotentialIsItsHeight) {
  Folder folder;
  std::vector<double> energies = relief;
  for (double& phi : energies) phi *= 9.80665;  // m2 s-2
  const auto ground =
      ground_by(folder / "a.nc", "z", "m**2 s**-2", "surface_geopotential", energies);
  ASSERT_TRUE(ground);
  expect_heights(*ground, relief);
}

TEST(GroundOfAFile, IsFoundByTheNamesOfModelsOnlyInUnitsOfLength) {
  Folder folder;
  for (const char* name : {"HGT", "HGT_M", "orog", "HSURF", "hsurf", "topography_c"}) {
    const auto ground = ground_by(folder / (std::string(name) + ".nc"), name, "m", "");
    ASSERT_TRUE(ground) << name;
    EXPECT_EQ(ground->kind, GroundKind::land);
  }
  for (const char* name : {"deptho", "Bathymetry", "depth_ocean"}) {
    const auto ground = ground_by(folder / (std::string(name) + ".nc"), name, "m", "");
    ASSERT_TRUE(ground) << name;
    EXPECT_EQ(ground->kind, GroundKind::sea_floor);
  }
  EXPECT_FALSE(ground_by(folder / "bare.nc", "HGT", "", ""));
  EXPECT_FALSE(ground_by(folder / "kelvin.nc", "orog", "K", ""));
  EXPECT_FALSE(ground_by(folder / "h.nc", "h", "m", "")) << "could be a layer's thickness";
  EXPECT_FALSE(ground_by(folder / "z500.nc", "z", "m2 s-2", "geopotential"))
      << "could be that of a surface of pressure";
}

TEST(GroundOfAFile, InUnknownUnitsIsNamedByANote) {
  Folder folder;
  const std::string path = file_with(folder / "a.nc", [](NetcdfMaker& made, int, int y, int x) {
    made.text(made.variable("zs", NC_DOUBLE, {y, x}, relief), "standard_name", "surface_altitude");
  });
  const auto source = opened(path);
  EXPECT_FALSE(source->info().grid.ground);
  EXPECT_TRUE(has_note(source->info(), "'zs' is not drawn as the ground: it is without a unit"));
}

TEST(GroundOfAFile, OfSeveralIsTheOneWithAStandardName) {
  Folder folder;
  const std::string path = file_with(folder / "a.nc", [](NetcdfMaker& made, int, int y, int x) {
    const std::vector<double> other(6, 7);
    made.text(made.variable("HGT", NC_DOUBLE, {y, x}, other), "units", "m");
    const int named = made.variable("zs", NC_DOUBLE, {y, x}, relief);
    made.text(named, "units", "m");
    made.text(named, "standard_name", "surface_altitude");
    const int deviation = made.variable("sd", NC_DOUBLE, {y, x}, other);
    made.text(deviation, "units", "m");
    made.text(deviation, "standard_name", "surface_altitude");
    made.text(deviation, "cell_methods", "area: standard_deviation");
  });
  const auto source = opened(path);
  ASSERT_TRUE(source->info().grid.ground);
  EXPECT_EQ(source->info().grid.ground->name, "zs");
  EXPECT_EQ(reason_of(source->info(), "zs"), "gives the height of the ground (view.ground)");
}

TEST(GroundOfAFile, ThatDependsOnTimeMustNotChange) {
  Folder folder;
  for (const double later : {0.0, 0.25}) {
    std::vector<double> values = relief;
    for (const double z : relief) values.push_back(z + later);
    const std::string path =
        file_with(folder / "a.nc", [&](NetcdfMaker& made, int time, int y, int x) {
          made.text(made.variable("HGT", NC_DOUBLE, {time, y, x}, values), "units", "m");
        });
    const auto source = opened(path);
    const auto& ground = source->info().grid.ground;
    EXPECT_EQ(ground != nullptr, later == 0);
    EXPECT_EQ(has_note(source->info(), "it changes with time"), later != 0);
    if (ground) expect_heights(*ground, relief);
  }
}

// Depths grow downward. Land is where the mask of the file has it, whatever depth is stored there;
// a masked depth without such a mask is unknown.
TEST(GroundOfAFile, OfAnOceanIsBelowTheSeaAndItsLandIsNot) {
  Folder folder;
  const std::vector<double> depths{4000, 30, 5, -2, 1e20, 1e20};
  const double open = std::nan("");
  for (const bool with_mask : {true, false}) {
    const std::string path = file_with(
        folder / "a.nc",
        [&](NetcdfMaker& made, int, int y, int x) {
          const int h = made.variable("h", NC_DOUBLE, {y, x}, depths);
          made.number(h, "_FillValue", NC_DOUBLE, {1e20});
          made.text(h, "units", "meter");
          made.text(h, "long_name", "bathymetry at RHO-points");
          if (with_mask) made.variable("mask_rho", NC_DOUBLE, {y, x}, {1, 1, 0, 0, 0, 1});
        },
        true);
    const auto source = opened(path);
    const auto ground = source->info().grid.ground;
    ASSERT_TRUE(ground);
    EXPECT_EQ(ground->kind, GroundKind::sea_floor);
    std::string reason;
    for (const LeftOut& left : source->info().left_out) {
      if (left.name == "mask_rho") reason = left.reason;
    }
    EXPECT_EQ(reason, with_mask ? "gives the land of the ground (view.ground)" : "");
    if (with_mask) {
      expect_heights(*ground, {-4000, -30, 0, 2, 0, open});
    } else {
      expect_heights(*ground, {-4000, -30, -5, 2, open, open});
    }
  }
}

TEST(GroundOfAFile, OfADepthOfZeroIsAtZero) {
  Folder folder;
  const auto ground = ground_by(folder / "a.nc", "deptho", "m", "", {0, 10, 0, 10, 0, 10});
  ASSERT_TRUE(ground);
  EXPECT_FALSE(std::signbit(ground->heights[0]));
}

TEST(GroundOfAFile, OfDepthsBelowZeroIsRefused) {
  Folder folder;
  const std::string path = file_with(folder / "a.nc", [](NetcdfMaker& made, int, int y, int x) {
    const int h = made.variable("deptho", NC_DOUBLE, {y, x}, {-10, -20, -30, -40, -50, -60});
    made.text(h, "units", "m");
    made.text(h, "standard_name", "sea_floor_depth_below_geoid");
  });
  const auto source = opened(path);
  EXPECT_FALSE(source->info().grid.ground);
  EXPECT_TRUE(has_note(source->info(), "its depths are below zero throughout"));
}

// NCEP names the height of any surface HGT.
TEST(GroundOfAFile, IsNoHeightOfASurfaceOfConstantPressure) {
  Folder folder;
  struct Case {
    const char* name;
    const char* units;
    const char* standard_name;
    const char* long_name;
    bool is_ground;
  };
  for (const Case& one :
       {Case{"HGT", "gpm", "", "Geopotential Height at 500 mb", false},
        Case{"hgt", "m", "", "Geopotential height", false},
        Case{"HGT", "gpm", "", "Geopotential height at the surface", true},
        Case{"HGT", "m", "", "Terrain Height", true},
        Case{"z", "m2 s-2", "geopotential", "Geopotential of the 500 hPa surface", false},
        Case{"z", "m2 s-2", "geopotential", "Geopotential at the surface", true},
        Case{"depth", "m", "", "Ocean mixed layer depth", false},
        Case{"depth", "m", "", "Depth of the ocean", true}}) {
    const std::string path = file_with(folder / "a.nc", [&](NetcdfMaker& made, int, int y, int x) {
      const int v = made.variable(one.name, NC_DOUBLE, {y, x}, {0, 1, 2, 3, 4, 5});
      made.text(v, "units", one.units);
      made.text(v, "long_name", one.long_name);
      if (*one.standard_name != 0) made.text(v, "standard_name", one.standard_name);
    });
    EXPECT_EQ(opened(path)->info().grid.ground != nullptr, one.is_ground) << one.long_name;
  }
}

// GEBCO and others call elevations bathymetry.
TEST(GroundOfAFile, IsUpwardWhereAnAttributeSaysSoAndRefusedWhereNoneDoes) {
  Folder folder;
  const std::vector<double> elevations{-4000, -300, -20, 0, 40, 900};
  for (const char* positive : {"up", ""}) {
    const std::string path = file_with(folder / "a.nc", [&](NetcdfMaker& made, int, int y, int x) {
      const int v = made.variable("bathymetry", NC_DOUBLE, {y, x}, elevations);
      made.text(v, "units", "m");
      if (*positive != 0) made.text(v, "positive", positive);
    });
    const auto source = opened(path);
    const auto& ground = source->info().grid.ground;
    if (*positive != 0) {
      ASSERT_TRUE(ground);
      expect_heights(*ground, elevations);
    } else {
      EXPECT_FALSE(ground);
      EXPECT_TRUE(has_note(source->info(), "its depths of -4000 .. 900 reach farther above zero"));
    }
  }
}

TEST(GroundOfAFile, IsNoFillValueWithoutAnAttribute) {
  Folder folder;
  const std::string path = file_with(folder / "a.nc", [](NetcdfMaker& made, int, int y, int x) {
    made.text(made.variable("orog", NC_DOUBLE, {y, x}, {0, 1, 2, 3, 4, 99999}), "units", "m");
  });
  const auto source = opened(path);
  EXPECT_FALSE(source->info().grid.ground);
  EXPECT_TRUE(has_note(source->info(), "its values reach 99999 m"));
}

TEST(GroundOfAFile, OnOtherPointsIsNamedByANote) {
  Folder folder;
  const std::string path = file_with(folder / "a.nc", [](NetcdfMaker& made, int, int y, int) {
    const int beside = made.dimension("lon_u", 4);
    const int v = made.variable("zs", NC_DOUBLE, {y, beside}, std::vector<double>(8, 1));
    made.text(v, "units", "m");
    made.text(v, "standard_name", "surface_altitude");
  });
  const auto source = opened(path);
  EXPECT_FALSE(source->info().grid.ground);
  EXPECT_TRUE(has_note(source->info(), "it is on other points than the fields"));
}

// Rows from north to south, as most files have them.
TEST(GroundOfAFile, FollowsTheOrderOfTheRows) {
  Folder folder;
  const std::string path = folder / "a.nc";
  NetcdfMaker made(path);
  const int z = made.axis("altitude", {10, 20}, "m", "altitude");
  const int y = made.axis("lat", {41, 40}, "degrees_north", "latitude");
  const int x = made.axis("lon", {5, 6, 7}, "degrees_east", "longitude");
  made.variable("t", NC_FLOAT, {z, y, x}, std::vector<double>(12, 280));
  made.text(made.variable("orog", NC_DOUBLE, {y, x}, relief), "units", "m");
  made.finish();
  const auto ground = opened(path)->info().grid.ground;
  ASSERT_TRUE(ground);
  expect_heights(*ground, {1500, 2500, -20, 0, 100, 200});
}

// The surface of a hybrid height is the ground, whatever its name.
TEST(GroundOfAFile, IsTheSurfaceOfTheFormulaOfTheLevels) {
  Folder folder;
  const std::string path = folder / "a.nc";
  NetcdfMaker made(path);
  const int z = made.axis("lev", {100, 500}, "m", "atmosphere_hybrid_height_coordinate");
  made.text(made.variable_id("lev"), "formula_terms", "a: lev b: b orog: under");
  made.text(made.variable_id("lev"), "positive", "up");
  made.variable("b", NC_DOUBLE, {z}, {0.9, 0.5});
  const int y = made.axis("lat", {40, 41}, "degrees_north", "latitude");
  const int x = made.axis("lon", {5, 6, 7}, "degrees_east", "longitude");
  made.variable("t", NC_FLOAT, {z, y, x}, std::vector<double>(12, 280));
  made.variable("under", NC_DOUBLE, {y, x}, relief);
  made.finish();
  const auto ground = opened(path)->info().grid.ground;
  ASSERT_TRUE(ground);
  EXPECT_EQ(ground->name, "under");
  expect_heights(*ground, relief);
}

}  // namespace
}  // namespace windsplat::data::test
