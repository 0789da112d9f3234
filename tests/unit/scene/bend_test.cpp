// Sample positions on a globe, on a curvilinear map and along terrain, compared with closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/place.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using data::AxisKind;
using protocol::GeometryMapping;
using protocol::GeometryView;
using protocol::View;

constexpr double tolerance = 1e-6;  // positions are floats
constexpr double degree = std::numbers::pi / 180;

std::vector<double> steps(double first, double step, int count) {
  std::vector<double> out;
  for (int n = 0; n < count; ++n) out.push_back(first + step * n);
  return out;
}

data::Grid globe() {
  data::Grid grid;
  grid.axes = {axis(AxisKind::longitude, "degrees_east", steps(0, 30, 12)),
               axis(AxisKind::latitude, "degrees_north", steps(-90, 30, 7)),
               axis(AxisKind::pressure, "hPa", {1000, 500, 250})};
  return grid;
}

GeometryView mapped(GeometryMapping mapping) {
  GeometryView geometry;
  geometry.mapping = mapping;
  return geometry;
}

glm::dvec3 place(const Lattice& lattice, int i, int j, int k) {
  const int n = (k * lattice.dims[1] + j) * lattice.dims[0] + i;
  const auto& p = (*lattice.places)[static_cast<std::size_t>(n)];
  return {p[0], p[1], p[2]};
}

void expect_near(const glm::dvec3& got, const glm::dvec3& wanted, const char* what) {
  EXPECT_LT(glm::length(got - wanted), tolerance)
      << what << ": " << got.x << ' ' << got.y << ' ' << got.z;
}

// Three equal cells of log p in a shell from 1 / 1.15 to 1.
double radius(int level, double scale = 1) {
  const double inner = 1 / (1 + 0.15 * scale);
  return inner + (level + 0.5) / 3 * (1 - inner);
}

TEST(Sphere, PolesAndEquatorAreInPlace) {
  const auto lattice = place_lattice(globe(), mapped(GeometryMapping::sphere));
  ASSERT_TRUE(lattice) << lattice.error().message;
  ASSERT_TRUE(lattice->places);
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < 12; ++i) {
      expect_near(place(*lattice, i, 0, k), {0, 0, -radius(k)}, "south pole");
      expect_near(place(*lattice, i, 6, k), {0, 0, radius(k)}, "north pole");
    }
    expect_near(place(*lattice, 0, 3, k), {0, -radius(k), 0}, "longitude 0");
    expect_near(place(*lattice, 3, 3, k), {radius(k), 0, 0}, "longitude 90 E");
    expect_near(place(*lattice, 6, 3, k), {0, radius(k), 0}, "longitude 180");
    const double low = radius(k) * std::cos(60 * degree);
    expect_near(place(*lattice, 3, 5, k), {low, 0, radius(k) * std::sin(60 * degree)}, "60 N 90 E");
  }
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(lattice->box_min[a], -1, tolerance);
    EXPECT_NEAR(lattice->box_max[a], 1, tolerance);
  }
}

// A region is as thick as on a flat map, 0.15 of its longer edge: 10 degrees of latitude. That of a
// globe, or of a region wider than the radius, is 0.15 of the radius.
TEST(Sphere, ARegionIsNoTower) {
  const auto thickness = [](const std::vector<double>& longitudes,
                            const std::vector<double>& latitudes) {
    data::Grid grid = globe();
    grid.axes[0].coordinates = longitudes;
    grid.axes[1].coordinates = latitudes;
    const auto lattice = place_lattice(grid, mapped(GeometryMapping::sphere));
    return lattice ? 1 / lattice->inner_radius - 1 : -1;
  };
  EXPECT_NEAR(thickness(steps(5, 1, 10), steps(45.5, 1, 10)), 0.15 * 10 * degree, 1e-9);
  EXPECT_NEAR(thickness(steps(0, 10, 4), steps(30, 5, 2)),
              0.15 * 40 * degree * std::cos(30 * degree), 1e-9);
  EXPECT_NEAR(thickness(steps(0, 10, 9), steps(-5, 5, 3)), 0.15, 1e-9);
  EXPECT_NEAR(thickness(steps(-170, 30, 12), steps(-90, 30, 7)), 0.15, 1e-9);
}

TEST(Sphere, RectilinearLatticeHasTheMeanCellsOfTheCurvedOne) {
  const auto lattice = place_lattice(globe(), mapped(GeometryMapping::sphere));
  ASSERT_TRUE(lattice);
  const double inner = 1 / 1.15;
  const double middle = 0.5 * (1 + inner);
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::size_t>(k);
    EXPECT_NEAR(lattice->spacing[2][at], (1 - inner) / 3, 1e-12);
    EXPECT_NEAR(lattice->positions[2][at], radius(k) - middle, 1e-12);
  }
  // Inside, half the chord over two steps; at the poles, a whole chord over one step.
  EXPECT_NEAR(lattice->spacing[1][3], middle * std::sin(30 * degree), tolerance);
  EXPECT_NEAR(lattice->spacing[1][0], middle * 2 * std::sin(15 * degree), tolerance);
  EXPECT_NEAR(lattice->positions[1][3], 0, tolerance);
  EXPECT_NEAR(lattice->positions[1][4] - lattice->positions[1][3],
              0.5 * (lattice->spacing[1][3] + lattice->spacing[1][4]), 1e-12);
}

TEST(Sphere, LongitudesCloseIfTheFirstAndTheLastAreNeighbours) {
  const auto around = [](double step, int count) {
    data::Grid grid = globe();
    grid.axes[0].coordinates = steps(-170, step, count);
    const auto lattice = place_lattice(grid, mapped(GeometryMapping::sphere));
    return lattice ? lattice->around : -1;
  };
  EXPECT_EQ(around(30, 12), 12);
  EXPECT_EQ(around(30, 11), 0);
  EXPECT_EQ(around(30, 13), 12);
  EXPECT_EQ(around(30, 14), 12);
  EXPECT_EQ(around(120, 3), 3);
  EXPECT_EQ(around(120, 4), 3);
  EXPECT_EQ(around(1, 40), 0);
  EXPECT_EQ(around(180, 2), 0);
  data::Grid stretched = globe();
  stretched.axes[0].coordinates = {0, 1, 40};
  const auto lattice = place_lattice(stretched, mapped(GeometryMapping::sphere));
  ASSERT_TRUE(lattice);
  EXPECT_EQ(lattice->around, 0);
}

TEST(Sphere, CellsAtTheSeamAreThoseOfEveryLongitude) {
  const auto lattice = place_lattice(globe(), mapped(GeometryMapping::sphere));
  ASSERT_TRUE(lattice);
  for (const double width : lattice->spacing[0]) {
    EXPECT_NEAR(width, lattice->spacing[0][5], tolerance);
  }
}

TEST(Sphere, HeightScalesTheShellOnly) {
  GeometryView geometry = mapped(GeometryMapping::sphere);
  geometry.scale = {5, 7, 2};
  const auto lattice = place_lattice(globe(), geometry);
  ASSERT_TRUE(lattice);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(glm::length(place(*lattice, 5, 2, k)), radius(k, 2), tolerance);
  }
  EXPECT_NEAR(lattice->box_max.z, 1, tolerance);
}

TEST(Sphere, SingleLevelIsAsThickAsItsColumnSpacing) {
  data::Grid grid = globe();
  grid.axes[0].coordinates = steps(0, 3, 120);
  grid.axes[2] = axis(AxisKind::pressure, "hPa", {500});
  const auto lattice = place_lattice(grid, mapped(GeometryMapping::sphere));
  ASSERT_TRUE(lattice);
  EXPECT_NEAR(glm::length(place(*lattice, 7, 3, 0)), 1 - 0.5 * 3 * degree, tolerance);
}

TEST(Sphere, NeedsLongitudesAndLatitudes) {
  data::Grid plain;
  for (data::Axis& each : plain.axes) each = axis(AxisKind::cartesian, "m", {0, 1, 2});
  const auto refused = place_lattice(plain, mapped(GeometryMapping::sphere));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  EXPECT_EQ(refused.error().at.at(0).pointer, "/geometry/mapping");
}

// Every sample is in the picture, and the globe fills most of it.
TEST(Sphere, IsFramedFromEveryDirection) {
  data::Grid grid = globe();
  grid.axes[0].coordinates = steps(0, 5, 72);
  grid.axes[1].coordinates = steps(-90, 5, 37);
  const auto lattice = place_lattice(grid, mapped(GeometryMapping::sphere));
  ASSERT_TRUE(lattice);
  for (const double elevation : {-90.0, -20.0, 0.0, 35.0, 90.0}) {
    for (const double azimuth : {0.0, 45.0, 200.0}) {
      View view;
      orbit(view, *lattice, azimuth, elevation, 1);
      const auto camera = resolve_camera(view, *lattice);
      ASSERT_TRUE(camera);
      double farthest = 0;
      for (const auto& p : *lattice->places) {
        const glm::dvec3 v = glm::dvec3(p[0], p[1], p[2]) - camera->eye;
        const double depth = glm::dot(v, camera->forward);
        ASSERT_GT(depth, camera->near);
        farthest = std::max(farthest, std::abs(glm::dot(v, camera->up)) / depth);
      }
      EXPECT_LT(farthest, camera->half_height) << azimuth << ' ' << elevation;
      EXPECT_GT(farthest, 0.7 * camera->half_height) << azimuth << ' ' << elevation;
      const auto depths = view_depths(*camera, *lattice);
      const double distance = glm::length(camera->eye);
      EXPECT_NEAR(depths[0], distance - 1, 0.06);
      EXPECT_NEAR(depths[1], distance + 1, 0.06);
    }
  }
}

// A default view is from above the part of the globe covered by the data.
TEST(Sphere, PartIsViewedFromAboveItself) {
  data::Grid grid = globe();
  grid.axes[0].coordinates = steps(120, 5, 7);
  grid.axes[1].coordinates = steps(-10, 5, 5);
  const auto lattice = place_lattice(grid, mapped(GeometryMapping::sphere));
  ASSERT_TRUE(lattice);
  EXPECT_NEAR(front_azimuth(*lattice), 135, 0.5);
  const OrbitFrame frame = orbit_frame(front_azimuth(*lattice), 0);
  EXPECT_LT(glm::dot(frame.forward, place(*lattice, 3, 2, 1)), -0.9);
  EXPECT_EQ(front_azimuth(*place_lattice(globe(), mapped(GeometryMapping::sphere))), 0);
}

// Columns 10 degrees of longitude apart, rows 5 degrees of latitude and 2 of longitude.
data::Grid sheared() {
  data::Grid grid;
  grid.axes = {axis(AxisKind::cartesian, "", steps(0, 1, 4)),
               axis(AxisKind::cartesian, "", steps(0, 1, 3)),
               axis(AxisKind::pressure, "hPa", {1000, 500})};
  auto columns = std::make_shared<data::Columns>();
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 4; ++i) {
      columns->longitude.push_back(350 + 10 * i + 2 * j);
      columns->latitude.push_back(5 * j);
    }
  }
  grid.columns = std::move(columns);
  return grid;
}

TEST(Curvilinear, EveryColumnHasItsLongitudeAndLatitude) {
  const auto lattice = place_lattice(sheared(), mapped(GeometryMapping::curvilinear));
  ASSERT_TRUE(lattice) << lattice.error().message;
  // Samples span 34 by 10 degrees; half a cell reaches (10 + 2) / 2 and 5 / 2 beyond them.
  // In the middle, at 5 N, a degree of longitude is cos(5 degrees) times as wide.
  const double narrow = std::cos(5 * degree);
  const double scale = 2.0 / (34 + 12) / narrow;
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 4; ++i) {
        const glm::dvec3 p = place(*lattice, i, j, k);
        EXPECT_NEAR(p.x, (10 * i + 2 * j - 17) * narrow * scale, tolerance);
        EXPECT_NEAR(p.y, (5 * j - 5) * scale, tolerance);
        EXPECT_NEAR(p.z, lattice->positions[2][static_cast<std::size_t>(k)], tolerance);
      }
    }
  }
  EXPECT_NEAR(lattice->box_min.x, -1, tolerance);
  EXPECT_NEAR(lattice->box_max.y, 7.5 * scale, tolerance);
  EXPECT_NEAR(lattice->spacing[0][1], 10 * narrow * scale, tolerance);
  EXPECT_NEAR(lattice->spacing[1][1], std::hypot(5, 2 * narrow) * scale, tolerance);
}

TEST(Curvilinear, ColumnsArePlacedOnTheGlobe) {
  const auto lattice = place_lattice(sheared(), mapped(GeometryMapping::sphere));
  ASSERT_TRUE(lattice);
  const glm::dvec3 p = place(*lattice, 3, 1, 1);  // 382 = 22 E, 5 N
  const glm::dvec3 up(std::cos(5 * degree) * std::sin(22 * degree),
                      -std::cos(5 * degree) * std::cos(22 * degree), std::sin(5 * degree));
  expect_near(p / glm::length(p), up, "22 E, 5 N");
}

TEST(Curvilinear, NeedsCoordinatesOfTwoDimensions) {
  const auto refused = place_lattice(globe(), mapped(GeometryMapping::curvilinear));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().at.at(0).pointer, "/geometry/mapping");
}

data::Grid metres() {
  data::Grid grid;
  grid.axes = {axis(AxisKind::cartesian, "m", steps(0, 10, 4)),
               axis(AxisKind::cartesian, "m", steps(0, 10, 2)),
               axis(AxisKind::level, "", {0, 1, 2})};
  return grid;
}

std::unique_ptr<data::Dataset> terrain(data::Grid grid, const std::string& units,
                                       std::function<double(std::size_t)> height,
                                       std::shared_ptr<FakeSource::Reads> reads = nullptr) {
  auto source = std::make_unique<FakeSource>(
      std::move(grid), std::vector<data::FieldInfo>{wind_info(), scalar_info("z", units)}, 2,
      std::move(reads));
  source->values = [height = std::move(height)](const std::string& field, std::size_t n) {
    return field == "z" ? height(n) : 1.0;
  };
  return dataset_of(std::move(source));
}

GeometryView with_heights(GeometryMapping mapping = GeometryMapping::flat) {
  GeometryView geometry = mapped(mapping);
  geometry.height_field = "z";
  return geometry;
}

// Heights in metres over axes in metres keep their proportion: a slope of 1 remains 1.
TEST(HeightField, TerrainKeepsItsSlope) {
  auto dataset = terrain(metres(), "m", [](std::size_t n) {
    const auto i = static_cast<double>(n % 4);
    return 100 + 10 * i + 20 * static_cast<double>(n / 8);
  });
  const auto placed = place_dataset(with_heights(), *dataset);
  ASSERT_TRUE(placed) << placed.error().message;
  const Lattice& lattice = (*placed)->lattice;
  const glm::dvec3 east = place(lattice, 2, 1, 1) - place(lattice, 1, 1, 1);
  EXPECT_NEAR(east.z, east.x, tolerance);
  EXPECT_NEAR(east.y, 0, tolerance);
  const glm::dvec3 up = place(lattice, 2, 1, 2) - place(lattice, 2, 1, 1);
  expect_near(up, {0, 0, 2 * east.x}, "a level of 20 m");
  EXPECT_NEAR(lattice.positions[2][1] - lattice.positions[2][0], 2 * east.x, tolerance);
  // Samples span 70 m; half a cell adds 10 m of a level and 5 m of the slope at both ends.
  EXPECT_NEAR(lattice.box_max.z - lattice.box_min.z, 10 * east.x, 10 * tolerance);
  EXPECT_NEAR(
      std::max(lattice.box_max.x - lattice.box_min.x, lattice.box_max.z - lattice.box_min.z), 2,
      tolerance);
  EXPECT_NEAR(lattice.box_min.z, -lattice.box_max.z, tolerance);
}

TEST(HeightField, MaskedHeightIsTheMeanOfItsNeighbours) {
  auto dataset = terrain(metres(), "m", [](std::size_t n) {
    if (n == 9) return std::nan("");
    return 10.0 * static_cast<double>(n / 8) + (n % 8 == 0 ? 7.0 : 0.0);
  });
  const auto placed = place_dataset(with_heights(), *dataset);
  ASSERT_TRUE(placed);
  const Lattice& lattice = (*placed)->lattice;
  // One of the three neighbours has the height 17, the others 10.
  const double one = place(lattice, 0, 0, 1).z - place(lattice, 2, 0, 1).z;
  EXPECT_NEAR(place(lattice, 1, 0, 1).z - place(lattice, 2, 0, 1).z, one / 3, tolerance);
}

// A sea of 100 m in the west and 10 m at the coast: the cells at the coast are level towards land.
TEST(HeightField, MaskedColumnsContinueTheHeightsAtTheirCoast) {
  auto dataset = terrain(metres(), "m", [](std::size_t n) {
    const std::size_t column = n % 4;
    const double level = static_cast<double>(n / 8) - 3.0;
    return column >= 2 ? std::nan("") : level * (column == 0 ? 100.0 : 10.0);
  });
  const auto placed = place_dataset(with_heights(), *dataset);
  ASSERT_TRUE(placed) << placed.error().message;
  const Lattice& lattice = (*placed)->lattice;
  for (int level = 0; level < 3; ++level) {
    for (const int land : {2, 3}) {
      EXPECT_NEAR(place(lattice, land, 0, level).z, place(lattice, 1, 0, level).z, tolerance);
    }
  }
  EXPECT_LT(place(lattice, 0, 0, 0).z, place(lattice, 1, 0, 0).z - 0.1);
}

// Only the last column is masked: around the globe its neighbours are the one before and the first.
TEST(HeightField, MaskedColumnsContinueTheHeightsAcrossTheSeamOfAGlobe) {
  auto dataset = terrain(globe(), "m", [](std::size_t n) {
    const std::size_t column = n % 12;
    if (column == 11) return std::nan("");
    return 1000.0 * static_cast<double>(n / 84) + (column == 0 ? 900.0 : 300.0);
  });
  GeometryView geometry = with_heights();
  geometry.mapping = GeometryMapping::sphere;
  const auto placed = place_dataset(geometry, *dataset);
  ASSERT_TRUE(placed) << placed.error().message;
  const Lattice& lattice = (*placed)->lattice;
  const auto height = [&](int column) { return glm::length(place(lattice, column, 3, 1)); };
  // Rows above and below have the same mean, so that the first wave gives that of both neighbours.
  EXPECT_NEAR(height(11), 0.5 * (height(0) + height(10)), tolerance);
  EXPECT_GT(height(0), height(10) + 0.01);
}

TEST(HeightField, IsPlacedToScaleOnRequest) {
  auto dataset =
      terrain(globe(), "m", [](std::size_t n) { return 1000.0 * static_cast<double>(n / 84); });
  GeometryView geometry = with_heights();
  geometry.vertical = protocol::VerticalPlacement::metric;
  const auto placed = place_dataset(geometry, *dataset);
  ASSERT_TRUE(placed) << placed.error().message;
  const glm::dvec3 up = place((*placed)->lattice, 0, 0, 1) - place((*placed)->lattice, 0, 0, 0);
  const glm::dvec3 north = place((*placed)->lattice, 0, 1, 0) - place((*placed)->lattice, 0, 0, 0);
  const double degrees =
      (*placed)->grid.axes[1].coordinates[1] - (*placed)->grid.axes[1].coordinates[0];
  EXPECT_NEAR(up.z / north.y, 1000 / (degrees * 6371000 * std::numbers::pi / 180), tolerance);
  geometry.mapping = GeometryMapping::sphere;
  const auto refused = place_dataset(geometry, *dataset);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().at.at(0).pointer, "/geometry/vertical");
}

TEST(HeightField, IsPlacedOnTheGlobe) {
  auto dataset = terrain(globe(), "m", [](std::size_t n) {
    return 1000.0 * static_cast<double>(n / 84) + (n % 84 == 40 ? 500.0 : 0.0);
  });
  const auto placed = place_dataset(with_heights(GeometryMapping::sphere), *dataset);
  ASSERT_TRUE(placed);
  const Lattice& lattice = (*placed)->lattice;
  // Levels 1000 m apart on average; from half of that below 0 to half above 2500 m.
  const double inner = 1 / 1.15;
  const auto at = [&](double height) { return inner + (height + 500) / 3500 * (1 - inner); };
  EXPECT_NEAR(glm::length(place(lattice, 0, 0, 0)), at(0), tolerance);
  EXPECT_NEAR(glm::length(place(lattice, 4, 3, 1)), at(1500), tolerance);
  EXPECT_NEAR(glm::length(place(lattice, 5, 3, 2)), at(2000), tolerance);
}

TEST(HeightField, SingleLevelIsASurface) {
  data::Grid grid = metres();
  grid.axes[2].coordinates = {0};
  auto dataset = terrain(grid, "m", [](std::size_t n) { return 5.0 * static_cast<double>(n % 4); });
  const auto placed = place_dataset(with_heights(), *dataset);
  ASSERT_TRUE(placed) << placed.error().message;
  const glm::dvec3 east = place((*placed)->lattice, 1, 0, 0) - place((*placed)->lattice, 0, 0, 0);
  EXPECT_NEAR(east.z, 0.5 * east.x, tolerance);
}

TEST(HeightField, OtherQuantitiesAreRefused) {
  const auto refusal = [](data::Dataset& dataset, const char* field) {
    View view;
    view.geometry.height_field = field;
    const auto refused = complete(view, dataset);
    EXPECT_FALSE(refused) << field;
    return refused ? std::string() : refused.error().at.at(0).pointer;
  };
  const std::string at = "/geometry/heightField";
  auto falling =
      terrain(metres(), "m", [](std::size_t n) { return -1.0 * static_cast<double>(n); });
  EXPECT_EQ(refusal(*falling, "z"), at);
  EXPECT_EQ(refusal(*falling, "wind"), at);
  EXPECT_EQ(refusal(*falling, "nope"), at);
  auto masked = terrain(metres(), "m", [](std::size_t n) {
    return n / 8 == 1 ? std::nan("") : static_cast<double>(n);
  });
  EXPECT_EQ(refusal(*masked, "z"), at);
}

// Heights of the first step, loaded once, and only by a view that names them.
TEST(HeightField, IsLoadedOnceAndOnlyIfNamed) {
  auto reads = std::make_shared<FakeSource::Reads>();
  auto dataset = terrain(
      metres(), "m", [](std::size_t n) { return static_cast<double>(n); }, reads);
  View view;
  view.step = 1;
  view.scalars.emplace();
  ASSERT_TRUE(build_scene(*complete(view, *dataset), *dataset));
  EXPECT_EQ(reads->count("z@0"), 0U);
  view.geometry = with_heights();
  const auto scene = build_scene(*complete(view, *dataset), *dataset);
  ASSERT_TRUE(scene);
  EXPECT_TRUE(scene->lattice.places);
  EXPECT_EQ((*reads)["z@0"], 1);
  EXPECT_EQ(reads->count("z@1"), 0U);
  // The next frame uses the same positions object, not an equal copy.
  const auto again = build_scene(*complete(view, *dataset), *dataset);
  EXPECT_EQ(again->lattice.places, scene->lattice.places);
  view.geometry.scale = {1, 1, 2};
  const auto taller = build_scene(*complete(view, *dataset), *dataset);
  EXPECT_NE(taller->lattice.places, scene->lattice.places);
}

// A metre has the same length anywhere on a globe: the middle radius of the shell over the radius
// of the Earth.
TEST(WorldRates, OnTheGlobeAreLengthsPerMeter) {
  auto dataset = dataset_of(
      std::make_unique<FakeSource>(globe(), std::vector<data::FieldInfo>{wind_info()}, 1));
  View view;
  view.geometry.mapping = GeometryMapping::sphere;
  view.vector.space = protocol::VectorSpace::world;
  const auto scene = build_scene(*complete(view, *dataset), *dataset);
  ASSERT_TRUE(scene) << scene.error().message;
  const double inner = 1 / 1.15;
  const double rate = 0.5 * (1 + inner) / 6371000.0;
  EXPECT_NEAR(scene->vector->rate_y, rate, 1e-6 * rate);
  ASSERT_EQ(scene->vector->rate_x.size(), 7U);
  for (const double x : scene->vector->rate_x) EXPECT_NEAR(x, rate, 1e-6 * rate);
  // w of 1 m/s: dp/dt = -p / H, and a factor of 2 in p is a third of the shell.
  const double up = (1 - inner) / 3 / std::log(2.0) / 7400.0;
  for (const double z : scene->vector->rate_z) EXPECT_NEAR(z, up, 1e-9 * up);
}

// 10 degrees of longitude at the equator and 5 of latitude have the lengths of the map.
TEST(WorldRates, OnACurvilinearMapAreThoseOfDegrees) {
  auto dataset = dataset_of(
      std::make_unique<FakeSource>(sheared(), std::vector<data::FieldInfo>{wind_info()}, 1));
  View view;
  view.geometry.mapping = GeometryMapping::curvilinear;
  view.vector.space = protocol::VectorSpace::world;
  const auto scene = build_scene(*complete(view, *dataset), *dataset);
  ASSERT_TRUE(scene) << scene.error().message;
  const double metre = 2.0 / 46 / std::cos(5 * degree) / (6371000.0 * degree);
  EXPECT_NEAR(scene->vector->rate_y, metre, 1e-5 * metre);
  for (int j = 0; j < 3; ++j) {
    const double wanted = metre * std::cos(5 * degree) / std::cos(5 * j * degree);
    EXPECT_NEAR(scene->vector->rate_x[static_cast<std::size_t>(j)], wanted, 1e-5 * wanted);
  }
}

}  // namespace
}  // namespace windsplat::scene
