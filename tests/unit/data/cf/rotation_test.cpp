// Winds on a rotated Lambert conformal conic: with n the sine of the tangent parallel, east is at
// gamma = n (lambda - lambda_0) from the x axis of the projection, so that a wind from due west has
// the components (cos, sin)(gamma - turn) along the grid axes.
#include "server/data/cf/fields/rotation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

constexpr std::size_t width = 9;
constexpr std::size_t height = 7;
constexpr double parallel = 45 * degree;
constexpr double meridian = 10;  // degrees

struct Lambert {
  double turn = 0;     // angle of the rows from the x axis of the projection, radians
  bool south = false;  // rows are stored from north to south
  std::vector<double> longitude;
  std::vector<double> latitude;
  std::vector<double> gamma;
};

// Columns 60 km apart around the tangent point, x fastest.
Lambert make_lambert(double turn, bool south) {
  Lambert out{turn, south, {}, {}, {}};
  const double n = std::sin(parallel);
  const double f =
      std::cos(parallel) * std::pow(std::tan(std::numbers::pi / 4 + parallel / 2), n) / n;
  const double rho_0 = f / std::pow(std::tan(std::numbers::pi / 4 + parallel / 2), n);
  for (std::size_t row = 0; row < height; ++row) {
    const std::size_t j = south ? height - 1 - row : row;
    for (std::size_t i = 0; i < width; ++i) {
      const double a = (static_cast<double>(i) + 3) * 60.0 / 6371;  // far east of the meridian
      const double b = (static_cast<double>(j) - 3) * 60.0 / 6371;
      const double x = a * std::cos(turn) - b * std::sin(turn);
      const double y = a * std::sin(turn) + b * std::cos(turn);
      const double rho = std::hypot(x, rho_0 - y);
      const double theta = std::atan2(x, rho_0 - y);
      out.longitude.push_back(meridian + theta / n / degree);
      out.latitude.push_back((2 * std::atan(std::pow(f / rho, 1 / n)) - std::numbers::pi / 2) /
                             degree);
      out.gamma.push_back(theta);
    }
  }
  return out;
}

// A wind of 3 m/s due east and 4 m/s due north everywhere.
void write_lambert(const std::string& path, const Lambert& grid, const std::string& u_name,
                   const std::string& v_name, bool with_metres) {
  NetcdfMaker file(path);
  int y = -1;
  int x = -1;
  if (with_metres) {
    std::vector<double> rows = counting(height);
    if (grid.south) std::reverse(rows.begin(), rows.end());
    y = file.axis("y", rows, "m", "projection_y_coordinate");
    x = file.axis("x", counting(width), "m", "projection_x_coordinate");
  } else {
    y = file.dimension("nj", height);
    x = file.dimension("ni", width);
  }
  file.text(file.variable("lat", NC_DOUBLE, {y, x}, grid.latitude), "units", "degrees_north");
  file.text(file.variable("lon", NC_DOUBLE, {y, x}, grid.longitude), "units", "degrees_east");
  for (const bool first : {true, false}) {
    const int v = file.variable(first ? "u" : "v", NC_FLOAT, {y, x},
                                std::vector<double>(width * height, first ? 3 : 4));
    file.text(v, "units", "m s-1");
    const std::string& name = first ? u_name : v_name;
    if (!name.empty()) file.text(v, "standard_name", name);
  }
}

TEST(Rotation, EastNorthWindsAreRotatedToTheGridAxes) {
  for (const double turn : {0.0, 25 * degree, -30 * degree}) {
    for (const bool south : {false, true}) {
      for (const bool with_metres : {false, true}) {
        const Folder folder;
        const Lambert grid = make_lambert(turn, south);
        write_lambert(folder / "l.nc", grid, "eastward_wind", "northward_wind", with_metres);
        auto source = open_file(folder / "l.nc");
        ASSERT_TRUE(source) << source.error().message;
        const DatasetInfo& info = (*source)->info();
        ASSERT_NE(info.grid.columns, nullptr);
        EXPECT_TRUE(has_note(info, "'wind' has components along east and north: rotated"));
        const Volume wind = volume_of(**source, "wind");
        for (std::size_t row = 0; row < height; ++row) {
          for (std::size_t i = 0; i < width; ++i) {
            // Volumes are ordered northward for any order of the file.
            const std::size_t n = row * width + i;
            const std::size_t stored = (south ? height - 1 - row : row) * width + i;
            EXPECT_NEAR(info.grid.columns->latitude[n], grid.latitude[stored], 1e-9);
            const double angle = grid.gamma[stored] - turn;
            // Finite differences of positions are of second order inside, of first at the edges
            // (1/200).
            const bool inside = row > 0 && row + 1 < height && i > 0 && i + 1 < width;
            const double near = inside ? 2e-4 : 2e-2;
            EXPECT_NEAR(wind.component(0)[n], 3 * std::cos(angle) - 4 * std::sin(angle), near);
            EXPECT_NEAR(wind.component(1)[n], 3 * std::sin(angle) + 4 * std::cos(angle), near);
            EXPECT_NEAR(std::hypot(wind.component(0)[n], wind.component(1)[n]), 5, 1e-5);
          }
        }
        // The component variables keep their values.
        EXPECT_EQ(volume_of(**source, "u").range, (std::array<float, 2>{3, 3}));
      }
    }
  }
}

// The rendered direction of the components: their sum along the unit vectors of the map's rows and
// columns. A map in degrees is not conformal: rows at an angle a from east have the direction (cos
// a / cos phi, sin a) on it, columns (-sin a / cos phi, cos a); normalising both turns an eastward
// wind by about 4 degrees at 45 N.
TEST(Rotation, EastWindPointsEastOnALatitudeLongitudeMap) {
  const Lambert lambert = make_lambert(25 * degree, false);
  const Columns columns{lambert.longitude, lambert.latitude};
  const cf::GridBearing bearing = cf::bearing_of(columns, width);
  std::vector<float> u(width * height, 1);
  std::vector<float> v(width * height, 0);
  cf::rotate(bearing, 1, u.data(), v.data());
  for (std::size_t n = width + 1; n + width + 1 < width * height; ++n) {
    if (n % width == 0 || n % width + 1 == width) continue;
    const auto unit = [&](std::size_t from, std::size_t to) {
      const double east = columns.longitude[to] - columns.longitude[from];
      const double north = columns.latitude[to] - columns.latitude[from];
      const double length = std::hypot(east, north);
      return std::array<double, 2>{east / length, north / length};
    };
    const auto x = unit(n - 1, n + 1);
    const auto y = unit(n - width, n + width);
    const double east = x[0] * u[n] + y[0] * v[n];
    const double north = x[1] * u[n] + y[1] * v[n];
    const double a = std::atan2(bearing.north[n], bearing.east[n]);
    const double shrink = std::cos(columns.latitude[n] * degree);
    const double row = 1 / std::hypot(std::cos(a) / shrink, std::sin(a));
    const double column = 1 / std::hypot(std::sin(a) / shrink, std::cos(a));
    const double off =
        std::atan2(std::cos(a) * std::sin(a) * (row - column),
                   (std::cos(a) * std::cos(a) * row + std::sin(a) * std::sin(a) * column) / shrink);
    EXPECT_NEAR(std::atan2(north, east) / degree, off / degree, 0.05);
    EXPECT_LT(std::abs(off) / degree, 4.5);
    // Without rotation the direction would deviate by the bearing of the rows.
    EXPECT_GT(std::abs(std::atan2(x[1], x[0])) / degree, 10);
  }
}

TEST(Rotation, GridWindsStayAndUnspecifiedOnesAreNoted) {
  const Lambert grid = make_lambert(25 * degree, false);
  for (const bool named : {true, false}) {
    const Folder folder;
    write_lambert(folder / "l.nc", grid, named ? "x_wind" : "", named ? "y_wind" : "", false);
    auto source = open_file(folder / "l.nc");
    ASSERT_TRUE(source) << source.error().message;
    const Volume wind = volume_of(**source, "wind");
    EXPECT_EQ(wind.component(0)[10], 3);
    EXPECT_EQ(wind.component(1)[10], 4);
    EXPECT_EQ(has_note((*source)->info(), "does not specify the direction of its components"),
              !named);
  }
}

TEST(Rotation, MirroredGridKeepsEastwardWinds) {
  // x runs north and y runs east: an eastward wind is along y.
  Columns columns;
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t i = 0; i < 4; ++i) {
      columns.longitude.push_back(10 + 0.01 * static_cast<double>(j));
      columns.latitude.push_back(20 + 0.01 * static_cast<double>(i));
    }
  }
  const cf::GridBearing bearing = cf::bearing_of(columns, 4);
  EXPECT_EQ(bearing.side, -1);
  std::vector<float> u(24, 2);
  std::vector<float> v(24, 5);
  cf::rotate(bearing, 2, u.data(), v.data());
  for (std::size_t n = 0; n < 24; ++n) {
    EXPECT_NEAR(u[n], 5, 1e-3);
    EXPECT_NEAR(v[n], 2, 1e-3);
  }
}

}  // namespace
}  // namespace windsplat::data::test
