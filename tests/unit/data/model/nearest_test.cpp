// The sample nearest to a position, on axes of every kind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <random>

#include "server/data/model/measure.hpp"

namespace windsplat::data {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Axis axis_of(AxisKind kind, std::vector<double> coordinates, std::string units = "") {
  Axis axis;
  axis.kind = kind;
  axis.units = std::move(units);
  axis.coordinates = std::move(coordinates);
  return axis;
}

// A quarter of the globe, descending latitudes, non-uniform pressures that descend upwards.
Grid model_grid() {
  Grid grid;
  grid.axes[0] =
      axis_of(AxisKind::longitude, {0, 10, 20, 30, 40, 50, 60, 70, 80, 90}, "degrees_east");
  grid.axes[1] = axis_of(AxisKind::latitude, {60, 50, 40, 30}, "degrees_north");
  grid.axes[2] = axis_of(AxisKind::pressure, {1000, 925, 850, 500, 100}, "hPa");
  return grid;
}

std::array<int, 3> found(const Grid& grid, double x, double y, double z) {
  const auto place = nearest_sample(grid, {x, y, z});
  EXPECT_TRUE(place) << (place ? "" : place.error().message);
  return place ? place->index : std::array{-1, -1, -1};
}

std::string refusal(const Grid& grid, const std::array<std::optional<double>, 3>& at) {
  const auto place = nearest_sample(grid, at);
  EXPECT_FALSE(place);
  if (place) return "";
  EXPECT_EQ(place.error().kind, ErrorKind::invalid);
  return place.error().message;
}

TEST(NearestSample, OnDescendingAndUnevenAxes) {
  const Grid grid = model_grid();
  EXPECT_THAT(found(grid, 0, 60, 1000), ElementsAre(0, 0, 0));
  EXPECT_THAT(found(grid, 14.9, 54.9, 963), ElementsAre(1, 1, 0));
  EXPECT_THAT(found(grid, 15.1, 55.1, 962), ElementsAre(2, 0, 1));
  EXPECT_THAT(found(grid, 90, 30, 676), ElementsAre(9, 3, 2));
  EXPECT_THAT(found(grid, 90, 31, 674), ElementsAre(9, 3, 3));
  EXPECT_THAT(found(grid, 90, 31, 299), ElementsAre(9, 3, 4));
  const auto place = nearest_sample(grid, {41, 37, 880});
  ASSERT_TRUE(place);
  EXPECT_THAT(place->coordinates, ElementsAre(40, 40, 850));
}

TEST(NearestSample, BoxExtendsHalfACellBeyondTheSamples) {
  const Grid grid = model_grid();
  EXPECT_THAT(found(grid, 94.9, 25.1, 1037), ElementsAre(9, 3, 0));
  EXPECT_THAT(found(grid, -4.9, 64.9, -99), ElementsAre(0, 0, 4));
  EXPECT_THAT(refusal(grid, {95.1, 40, 850}), HasSubstr("-5 to 95 degrees_east"));
  EXPECT_THAT(refusal(grid, {0, 65.1, 850}), HasSubstr("25 to 65 degrees_north"));
  EXPECT_THAT(refusal(grid, {0, 24.9, 850}), HasSubstr("y (or lat) = 24.9"));
  EXPECT_THAT(refusal(grid, {0, 40, 1038}), HasSubstr("to 1037.5 hPa"));
  EXPECT_THAT(refusal(grid, {0, 40, std::nullopt}), HasSubstr("z (or level) is required"));
}

TEST(NearestSample, OnlyLongitudesArePeriodic) {
  const Grid grid = model_grid();
  EXPECT_THAT(found(grid, 360 + 42, 40, 850)[0], 4);
  EXPECT_THAT(found(grid, -360 * 7 + 42, 40, 850)[0], 4);
  EXPECT_THAT(found(grid, 357, 40, 850)[0], 0) << "3 degrees west of the first";
  refusal(grid, {180, 40, 850});
  Grid box = grid;
  box.axes[0] = axis_of(AxisKind::cartesian, {0, 10, 20}, "m");
  refusal(box, {370, 40, 850});
}

TEST(NearestSample, GlobalGridHasNoEdgeAtTheSeam) {
  Grid grid = model_grid();
  std::vector<double> longitudes;
  for (int i = 0; i < 144; ++i) longitudes.push_back(-180 + 2.5 * i);
  grid.axes[0] = axis_of(AxisKind::longitude, longitudes, "degrees_east");
  EXPECT_EQ(found(grid, 179.0, 40, 850)[0], 0) << "1 degree from -180, 1.5 from 177.5";
  EXPECT_EQ(found(grid, 178.0, 40, 850)[0], 143);
  EXPECT_EQ(found(grid, 270, 40, 850)[0], 36) << "-90";
  EXPECT_EQ(found(grid, -1e6 * 360 - 90, 40, 850)[0], 36);
}

TEST(NearestSample, LatitudesEndAtThePole) {
  Grid grid = model_grid();
  grid.axes[1] = axis_of(AxisKind::latitude, {-90, 0, 90}, "degrees_north");
  EXPECT_EQ(found(grid, 0, 90, 850)[1], 2);
  EXPECT_THAT(refusal(grid, {0, 91, 850}), HasSubstr("-90 to 90"));
}

TEST(NearestSample, DimensionOfOneNeedsNoCoordinate) {
  Grid grid = model_grid();
  grid.axes[2] = axis_of(AxisKind::level, {1});
  const auto place = nearest_sample(grid, {10, 40, std::nullopt});
  ASSERT_TRUE(place);
  EXPECT_THAT(place->index, ElementsAre(1, 2, 0));
  EXPECT_EQ(place->coordinates[2], 1);
}

// Columns of a rotated-pole grid: a cap around the true pole, where longitude and latitude do not
// indicate neighbours.
Grid polar_grid(int n, double spacing) {
  auto columns = std::make_shared<Columns>();
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double x = (i - (n - 1) / 2.0) * spacing;
      const double y = (j - (n - 1) / 2.0) * spacing;
      columns->latitude.push_back(90 - std::hypot(x, y));
      columns->longitude.push_back(std::atan2(y, x) * 180 / M_PI);
    }
  }
  Grid grid = model_grid();
  std::vector<double> index(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) index[static_cast<std::size_t>(i)] = i;
  grid.axes[0] = axis_of(AxisKind::cartesian, index);
  grid.axes[1] = axis_of(AxisKind::cartesian, index);
  grid.columns = std::move(columns);
  return grid;
}

TEST(NearestSample, NearestColumnIsMeasuredOnTheSphere) {
  const int n = 20;
  const Grid grid = polar_grid(n, 1);
  const Columns& columns = *grid.columns;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> inside(-9.4, 9.4);
  for (int trial = 0; trial < 300; ++trial) {
    const double x = inside(random);
    const double y = inside(random);
    const double latitude = 90 - std::hypot(x, y);
    const double longitude = std::atan2(y, x) * 180 / M_PI + 360 * (trial % 3 - 1);
    const std::array<int, 3> index = found(grid, longitude, latitude, 850);
    // From unit vectors, an independent formula for the distance.
    const auto unit = [](double lon, double lat) {
      const double a = lon * M_PI / 180;
      const double b = lat * M_PI / 180;
      return std::array{std::cos(a) * std::cos(b), std::sin(a) * std::cos(b), std::sin(b)};
    };
    const auto at = unit(longitude, latitude);
    double most = -2;
    for (std::size_t i = 0; i < columns.latitude.size(); ++i) {
      const auto c = unit(columns.longitude[i], columns.latitude[i]);
      most = std::max(most, c[0] * at[0] + c[1] * at[1] + c[2] * at[2]);
    }
    const auto own = static_cast<std::size_t>(index[1] * n + index[0]);
    const auto c = unit(columns.longitude[own], columns.latitude[own]);
    EXPECT_NEAR(c[0] * at[0] + c[1] * at[1] + c[2] * at[2], most, 1e-14) << trial;
    EXPECT_EQ(index[2], 2);
  }
}

TEST(NearestSample, OutsideTheColumnsIsRefusedWithTheirBox) {
  const Grid grid = polar_grid(20, 1);
  EXPECT_EQ(found(grid, 0, 90 - 9.9, 850)[0], 19) << "within half a cell of the rim at 9.5";
  for (const double longitude : {90, 180, 270}) refusal(grid, {longitude, 78, 850});
  const std::string refused = refusal(grid, {0, 78, 850});
  EXPECT_THAT(refused, HasSubstr("latitudes 76.5"));
  EXPECT_THAT(refused, HasSubstr("to 89.29"));
  EXPECT_THAT(refusal(grid, {400000, 5000000, 850}),
              HasSubstr("x and y are longitude and latitude"))
      << "metres of a map";
  refusal(grid, {std::nullopt, 85, 850});
}

// Levels over a slope that rises by 100 m per column, three of them 1000 m apart.
TEST(NearestSample, HeightsOfTheColumnReplaceTheVerticalAxis) {
  Grid grid = model_grid();
  grid.axes[2] = axis_of(AxisKind::height, {450, 1450, 2450}, "m");
  auto volume = std::make_shared<Volume>();
  volume->dims = {10, 4, 3};
  volume->values = Samples(120);
  for (std::size_t n = 0; n < 120; ++n) {
    volume->values[n] = static_cast<float>(100 * (n % 10) + 1000 * (n / 40));
  }
  volume->values[40] = std::nanf("");
  const SampleHeights heights{volume, "metres"};
  for (const auto& [x, z, level, height] :
       {std::array{10.0, 599.0, 0.0, 100.0}, std::array{10.0, 601.0, 1.0, 1100.0},
        std::array{90.0, 601.0, 0.0, 900.0}, std::array{90.0, 3399.0, 2.0, 2900.0}}) {
    const auto place = nearest_sample(grid, {x, 60, z}, &heights);
    ASSERT_TRUE(place) << place.error().message;
    EXPECT_EQ(place->index[2], static_cast<int>(level)) << x << ' ' << z;
    EXPECT_EQ(place->coordinates[2], height);
  }
  const auto above = nearest_sample(grid, {10, 60, 2700}, &heights);
  ASSERT_FALSE(above);
  EXPECT_THAT(above.error().message, HasSubstr("-400 to 2600 metres"));
  const auto masked = nearest_sample(grid, {0, 60, 0}, &heights);
  ASSERT_FALSE(masked);
  EXPECT_THAT(masked.error().message, HasSubstr("level 1 has no height"));
}

}  // namespace
}  // namespace windsplat::data
