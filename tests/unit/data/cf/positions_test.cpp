// Longitudes and latitudes of files, and the directions of vectors on the resulting axes. Expected
// values are plane and spherical geometry.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

int text_variable(NetcdfMaker& file, const char* name, const std::vector<int>& dims,
                  const std::vector<double>& values, const char* units, const char* standard) {
  const int v = file.variable(name, NC_DOUBLE, dims, values);
  file.text(v, "units", units);
  if (*standard != '\0') file.text(v, "standard_name", standard);
  return v;
}

TEST(Positions, RadiansBecomeDegrees) {
  for (const char* units : {"radians", "radian", "rad"}) {
    const Folder folder;
    {
      NetcdfMaker file(folder / "r.nc");
      const int y = file.axis("lat", {-90 * degree, 0, 45 * degree}, units, "latitude");
      const int x = file.axis("lon", {0, 90 * degree}, units, "longitude");
      file.variable("f", NC_FLOAT, {y, x}, counting(6));
    }
    auto source = open_file(folder / "r.nc");
    ASSERT_TRUE(source) << source.error().message;
    const auto& axes = (*source)->info().grid.axes;
    EXPECT_EQ(axes[0].kind, AxisKind::longitude);
    EXPECT_EQ(axes[1].kind, AxisKind::latitude);
    EXPECT_EQ(axes[0].units, "degrees");
    EXPECT_NEAR(axes[0].coordinates.at(1), 90, 1e-9);
    EXPECT_NEAR(axes[1].coordinates.at(0), -90, 1e-9);
    EXPECT_NEAR(axes[1].coordinates.at(2), 45, 1e-9);
    EXPECT_TRUE(has_note((*source)->info(), "'lat' is in radians"));
  }
}

TEST(Positions, RadiansOfTwoDimensionsBecomeDegrees) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "r.nc");
    const int j = file.dimension("nj", 2);
    const int i = file.dimension("ni", 3);
    // 190 degrees minus 360 continues 179.
    text_variable(
        file, "clon", {j, i},
        {178 * degree, 179 * degree, -170 * degree, 178 * degree, 179 * degree, -170 * degree},
        "radian", "longitude");
    text_variable(file, "clat", {j, i},
                  {40 * degree, 40 * degree, 40 * degree, 41 * degree, 41 * degree, 41 * degree},
                  "radian", "latitude");
    file.variable("f", NC_FLOAT, {j, i}, counting(6));
  }
  auto source = open_file(folder / "r.nc");
  ASSERT_TRUE(source) << source.error().message;
  const auto& columns = (*source)->info().grid.columns;
  ASSERT_NE(columns, nullptr);
  EXPECT_NEAR(columns->longitude.at(2), 190, 1e-9);
  EXPECT_NEAR(columns->latitude.at(3), 41, 1e-9);
  EXPECT_EQ(volume_of(**source, "f").values[2], 2);
}

// A grid of indices i (fastest) and j with the given steps on the map, and a wind of 10 along i, 1
// along j and 4 upward.
struct Steps {
  std::array<double, 2> i;  // longitude, latitude
  std::array<double, 2> j;
};

void write_turned(const std::string& path, const Steps& steps, const std::string& x_name,
                  const std::string& y_name, bool omega = false) {
  NetcdfMaker file(path);
  const int z = omega ? file.axis("plev", {100000, 50000}, "Pa", "air_pressure")
                      : file.axis("height", {10, 20}, "m", "height");
  const int j = file.dimension("j", 3);
  const int i = file.dimension("i", 4);
  std::vector<double> lon;
  std::vector<double> lat;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      lon.push_back(10 + steps.i[0] * column + steps.j[0] * row);
      lat.push_back(1 + steps.i[1] * column + steps.j[1] * row);
    }
  }
  text_variable(file, "lon2", {j, i}, lon, "degrees_east", "longitude");
  text_variable(file, "lat2", {j, i}, lat, "degrees_north", "latitude");
  text_variable(file, "u", {z, j, i}, std::vector<double>(24, 10), "m s-1", x_name.c_str());
  text_variable(file, "v", {z, j, i}, std::vector<double>(24, 1), "m s-1", y_name.c_str());
  text_variable(file, "w", {z, j, i}, std::vector<double>(24, 4), omega ? "Pa s-1" : "m s-1",
                omega ? "lagrangian_tendency_of_air_pressure" : "upward_air_velocity");
}

struct Turned {
  Steps steps;
  std::array<float, 2> drawn;  // the wind along the rendered axes, which run east and north
  const char* note;
};

void PrintTo(const Turned& turned, std::ostream* out) {
  *out << turned.drawn[0] << ',' << turned.drawn[1];
}

// The eastward and northward components are 10 steps.i + 1 steps.j, in steps of unit length.
class TurnedAxes : public testing::TestWithParam<Turned> {};

TEST_P(TurnedAxes, VectorsAlongRowsAndColumnsAreRotatedWithThem) {
  const auto& [steps, drawn, note] = GetParam();
  const Folder folder;
  write_turned(folder / "t.nc", steps, "x_wind", "y_wind");
  auto source = open_file(folder / "t.nc");
  ASSERT_TRUE(source) << source.error().message;
  const Volume wind = volume_of(**source, "wind");
  ASSERT_EQ(wind.components, 3);
  for (std::size_t n = 0; n < wind.samples(); ++n) {
    ASSERT_EQ(wind.component(0)[n], drawn[0]);
    ASSERT_EQ(wind.component(1)[n], drawn[1]);
    ASSERT_EQ(wind.component(2)[n], 4);
  }
  EXPECT_TRUE(has_note((*source)->info(), note));
  const auto& columns = *(*source)->info().grid.columns;
  EXPECT_GT(columns.longitude[1], columns.longitude[0]);
  EXPECT_GT(columns.latitude.back(), columns.latitude.front());
}

// Files stored north to south usually have a northward v, rarely one along the index.
TEST_P(TurnedAxes, VectorsWithoutADirectionStayAndAreNoted) {
  const Folder folder;
  write_turned(folder / "t.nc", GetParam().steps, "", "");
  auto source = open_file(folder / "t.nc");
  ASSERT_TRUE(source) << source.error().message;
  const Volume wind = volume_of(**source, "wind");
  EXPECT_EQ(wind.component(0)[5], 10);
  EXPECT_EQ(wind.component(1)[5], 1);
  EXPECT_TRUE(has_note((*source)->info(), "does not specify the direction of its components"));
}

TEST_P(TurnedAxes, HorizontalPartOfDerivedMotionIsRotated) {
  const auto& [steps, drawn, note] = GetParam();
  const Folder folder;
  write_turned(folder / "t.nc", steps, "x_wind", "y_wind", true);
  auto source = open_file(folder / "t.nc");
  ASSERT_TRUE(source) << source.error().message;
  const Volume wind = volume_of(**source, "wind_m");
  EXPECT_EQ(wind.component(0)[5], drawn[0]);
  EXPECT_EQ(wind.component(1)[5], drawn[1]);
  EXPECT_LT(wind.component(2)[5], 0);  // a decreasing pressure tendency is upward, an increasing
                                       // one downward
}

TEST_P(TurnedAxes, VectorsByEastAndNorthStay) {
  const Folder folder;
  write_turned(folder / "t.nc", GetParam().steps, "eastward_wind", "northward_wind");
  auto source = open_file(folder / "t.nc");
  ASSERT_TRUE(source) << source.error().message;
  const Volume wind = volume_of(**source, "wind");
  EXPECT_NEAR(wind.component(0)[5], 10, 0.05);
  EXPECT_NEAR(wind.component(1)[5], 1, 0.05);
  EXPECT_FALSE(has_note((*source)->info(), "along rows and columns"));
}

INSTANTIATE_TEST_SUITE_P(
    Positions, TurnedAxes,
    testing::Values(Turned{{{0, 0.01}, {-0.01, 0}}, {-1, 10}, "exchanged and reversed"},
                    Turned{{{-0.01, 0}, {0, -0.01}}, {-10, -1}, "they are reversed"},
                    Turned{{{0, -0.01}, {0.01, 0}}, {1, -10}, "exchanged and reversed"},
                    Turned{{{0.01, 0}, {0, -0.01}}, {10, -1}, "they are reversed"},
                    Turned{{{0, 0.01}, {0.01, 0}}, {1, 10}, "exchanged with the axes"}));

using Vector = std::array<double, 3>;
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector unit(const Vector& a) {
  const double length = std::sqrt(dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}
Vector place(double longitude, double latitude) {
  return {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
          std::sin(latitude)};
}

constexpr std::array<double, 2> pole{-162, 39.25};
const std::vector<double> grid_rows{-6, -4, -2, 0, 2};
const std::vector<double> grid_columns{-10, -9, -8, -7, -6, -5};

void write_pole(const std::string& path, const char* mapping, double north_longitude) {
  NetcdfMaker file(path);
  const int y = file.axis("rlat", grid_rows, "degrees", "grid_latitude");
  const int x = file.axis("rlon", grid_columns, "degrees", "grid_longitude");
  const int rp = file.variable("rp", NC_INT, {}, {0});
  file.text(rp, "grid_mapping_name", mapping);
  file.number(rp, "grid_north_pole_longitude", NC_DOUBLE, {pole[0]});
  if (*mapping == 'r') file.number(rp, "grid_north_pole_latitude", NC_DOUBLE, {pole[1]});
  if (north_longitude != 0) {
    file.number(rp, "north_pole_grid_longitude", NC_DOUBLE, {north_longitude});
  }
  const std::vector<double> u(30, 3);
  const std::vector<double> v(30, 4);
  file.text(text_variable(file, "ua", {y, x}, u, "m s-1", "eastward_wind"), "grid_mapping", "rp");
  file.text(text_variable(file, "va", {y, x}, v, "m s-1", "northward_wind"), "grid_mapping", "rp");
}

// Axes of the rotated grid: its pole, the direction of its longitude of the true pole, and the
// direction perpendicular to both.
TEST(Positions, RotatedPoleColumnsAndWindsFollowTheirFrame) {
  for (const double north : {0.0, 25.0}) {
    const Folder folder;
    write_pole(folder / "p.nc", "rotated_latitude_longitude", north);
    auto source = open_file(folder / "p.nc");
    ASSERT_TRUE(source) << source.error().message;
    const auto& columns = (*source)->info().grid.columns;
    ASSERT_NE(columns, nullptr);
    const Volume wind = volume_of(**source, "wind");
    const Vector up = place(pole[0] * degree, pole[1] * degree);
    const Vector true_pole{0, 0, 1};
    const double share = dot(true_pole, up);
    const Vector ahead = unit({-share * up[0], -share * up[1], 1 - share * up[2]});
    const Vector aside = cross(up, ahead);
    std::size_t n = 0;
    for (const double row : grid_rows) {
      for (const double column : grid_columns) {
        const Vector local = place((column - north) * degree, row * degree);
        Vector at{};
        for (std::size_t c = 0; c < 3; ++c) {
          at.at(c) = local[0] * ahead.at(c) + local[1] * aside.at(c) + local[2] * up.at(c);
        }
        EXPECT_NEAR(columns->latitude[n], std::asin(at[2]) / degree, 1e-9);
        EXPECT_NEAR(std::remainder(columns->longitude[n] - std::atan2(at[1], at[0]) / degree, 360),
                    0, 1e-9);
        const Vector east = unit(cross(true_pole, at));
        const Vector to_north = cross(at, east);
        const Vector along_x = unit(cross(up, at));
        const Vector along_y = cross(at, along_x);
        // Finite differences are of first order at the edges.
        EXPECT_NEAR(wind.component(0)[n], 3 * dot(east, along_x) + 4 * dot(to_north, along_x),
                    0.05);
        EXPECT_NEAR(wind.component(1)[n], 3 * dot(east, along_y) + 4 * dot(to_north, along_y),
                    0.05);
        ++n;
      }
    }
    EXPECT_TRUE(has_note((*source)->info(), "computed from the map projection 'rp'"));
    EXPECT_TRUE(has_note((*source)->info(), "'wind' has components along east and north: rotated"));
  }
}

TEST(Positions, EastNorthWindsOnAMapWithoutPositionsAreNoted) {
  struct Case {
    const char* mapping;
    const char* name;
    bool noted;
  };
  for (const Case& c : {Case{"lambert_conformal_conic", "eastward_wind", true},
                        Case{"lambert_conformal_conic", "x_wind", false},
                        Case{"mercator", "eastward_wind", false}}) {
    const Folder folder;
    {
      NetcdfMaker file(folder / "l.nc");
      const int y = file.axis("y", {0, 1e5, 2e5}, "m", "projection_y_coordinate");
      const int x = file.axis("x", {0, 1e5}, "m", "projection_x_coordinate");
      file.text(file.variable("crs", NC_INT, {}, {0}), "grid_mapping_name", c.mapping);
      for (const char* name : {"u", "v"}) {
        const bool first = *name == 'u';
        const std::string standard = !first && *c.name == 'e' ? "northward_wind"
                                     : !first                 ? "y_wind"
                                                              : c.name;
        const int v = text_variable(file, name, {y, x}, counting(6), "m s-1", standard.c_str());
        file.text(v, "grid_mapping", "crs: x y");
      }
    }
    auto source = open_file(folder / "l.nc");
    ASSERT_TRUE(source) << source.error().message;
    EXPECT_EQ((*source)->info().grid.columns, nullptr);
    EXPECT_EQ(has_note((*source)->info(), "is drawn as if rows ran east"), c.noted) << c.mapping;
    EXPECT_EQ(volume_of(**source, "wind").component(0)[5], 5);
  }
  const Folder folder;
  write_pole(folder / "p.nc", "lacks_its_pole", 0);
  auto source = open_file(folder / "p.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->info().grid.columns, nullptr);
  EXPECT_TRUE(has_note((*source)->info(), "is drawn as if rows ran east"));
}

}  // namespace
}  // namespace windsplat::data::test
