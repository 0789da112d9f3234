// Positions without outlines: their Delaunay polygons, and files drawn by them.
#include "server/data/cf/mesh/delaunay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "tests/unit/data/cf/mesh_maker.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::mesh {
namespace {

using testing::HasSubstr;
using Direction = std::array<double, 3>;

struct Places {
  Table x;
  Table y;
};

Direction direction(const Places& places, std::size_t n) {
  const double from_axis = std::cos(places.y[n] * degree);
  return {from_axis * std::cos(places.x[n] * degree), from_axis * std::sin(places.x[n] * degree),
          std::sin(places.y[n] * degree)};
}

double dot(const Direction& a, const Direction& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Direction cross(const Direction& a, const Direction& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Direction from_to(const Direction& a, const Direction& b) {
  return {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
}

// Points of a Fibonacci spiral around the globe, all as far apart.
Places spiral(std::size_t count) {
  Places out;
  for (std::size_t n = 0; n < count; ++n) {
    const auto i = static_cast<double>(n);
    out.x.push_back(std::remainder(i * 222.49223594996215, 360.0));
    out.y.push_back(std::asin(1 - (2 * i + 1) / static_cast<double>(count)) / degree);
  }
  return out;
}

Places random_places(std::size_t count) {
  Places out;
  std::mt19937 random(7);
  const auto part = [&] { return static_cast<double>(random()) / 4294967296.0; };
  for (std::size_t n = 0; n < count; ++n) {
    out.x.push_back(170 + 30 * part());
    out.y.push_back(60 + 20 * part());
  }
  return out;
}

// Whether no position lies in the circle around any polygon: none is beyond the plane through three
// of its corners, as seen from the middle of the globe.
void expect_empty_circles(const Places& places, const cf::Mesh& mesh) {
  for (std::size_t c = 0; c < mesh.cells(); ++c) {
    const auto corner = [&](std::size_t i) {
      return direction(places, mesh.corners[mesh.first[c] + i]);
    };
    const Direction a = corner(0);
    const Direction ab = from_to(a, corner(1));
    const Direction ac = from_to(a, corner(2));
    const Direction normal = cross(ab, ac);
    const double outward = std::copysign(1 / std::sqrt(dot(normal, normal)), dot(normal, a));
    const double tolerance = 1e-4 * std::max(dot(ab, ab), dot(ac, ac));
    for (std::size_t n = 0; n < places.x.size(); ++n) {
      const double above = dot(normal, from_to(a, direction(places, n))) * outward;
      ASSERT_LT(above, tolerance) << c << ' ' << n;
    }
  }
}

std::size_t triangles_in(const cf::Mesh& mesh) { return mesh.corners.size() - 2 * mesh.cells(); }

TEST(Delaunay, PolygonsOnTheGlobeHaveEmptyCirclesAndAreAllThereAre) {
  for (const std::size_t count : {100U, 333U, 1000U}) {
    const Places places = spiral(count);
    const auto found = cf::triangulate(places.x, places.y);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(found->gaps, 0U);
    EXPECT_EQ(triangles_in(found->mesh), 2 * count - 4);  // Euler
    expect_empty_circles(places, found->mesh);
  }
}

TEST(Delaunay, PolygonsOfARegionHaveEmptyCirclesAndCoverIt) {
  const Places places = random_places(400);
  const auto found = cf::triangulate(places.x, places.y);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_GT(triangles_in(found->mesh) + found->gaps, 2 * 400U - 2 - 60);
  // Euler, with a rim of 13 positions or more: nothing lies around the rest of the globe.
  EXPECT_LE(triangles_in(found->mesh) + found->gaps, 2 * 400U - 2 - 13);
  EXPECT_LT(found->gaps, 40U);
  expect_empty_circles(places, found->mesh);
}

TEST(Delaunay, RepeatedAndMissingPositionsAreNoCorners) {
  Places places = spiral(300);
  places.x[20] = std::numeric_limits<double>::quiet_NaN();
  for (const std::size_t n : {0U, 150U}) {
    places.x.push_back(places.x[n] + 360);
    places.y.push_back(places.y[n]);
  }
  const auto found = cf::triangulate(places.x, places.y);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->missing, 1U);
  EXPECT_EQ(found->repeated, 2U);
  EXPECT_EQ(triangles_in(found->mesh), 2 * 299U - 4);
  EXPECT_EQ(std::count(found->mesh.corners.begin(), found->mesh.corners.end(), 20U), 0);
  EXPECT_EQ(found->mesh.nodes(), 302U);
}

TEST(Delaunay, ClosePositionsAnywhereLoseNoOthers) {
  // In degrees: a repeat, 0.2 m, 1 m and 1 km.
  for (const double apart : {1e-7, 2e-6, 1e-5, 1e-2}) {
    Places places = spiral(3000);
    places.x.insert(places.x.begin(), places.x[0]);
    places.y.insert(places.y.begin(), places.y[0] - apart);
    const auto found = cf::triangulate(places.x, places.y);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_LE(found->repeated, apart < 1e-5 ? 1U : 0U) << apart;
    EXPECT_EQ(triangles_in(found->mesh) + found->gaps, 2 * (3001 - found->repeated) - 4) << apart;
  }
}

TEST(Delaunay, ClustersOppositeToEachOtherAreBothWhole) {
  Places places;
  std::mt19937 random(5);
  for (int n = 0; n < 4000; ++n) {
    const auto part = [&] { return static_cast<double>(random()) / 4294967296.0; };
    places.x.push_back((n % 2 == 0 ? 0 : 180) + 5 * part());
    places.y.push_back((n % 2 == 0 ? 1 : -1) * 5 * part());
  }
  const auto found = cf::triangulate(places.x, places.y);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->repeated, 0U);
  EXPECT_GT(triangles_in(found->mesh), 7500U);
}

// The directions from which positions around the globe may be projected, and their opposites, with
// positions within `apart` degrees.
Places near_origins(std::size_t count, double apart) {
  Places out = spiral(400);
  for (std::size_t n = 0; n < count; ++n) {
    const auto i = static_cast<double>(n);
    const double x = std::remainder(222.49223594996215 * i + 1.234567, 360.0);
    const double y = std::asin((i + 0.5) / 128) / degree;
    out.x.insert(out.x.end(), {x, x + 180});
    out.y.insert(out.y.end(), {y + apart, -y - apart});
  }
  return out;
}

TEST(Delaunay, TheOriginIsFarFromAllPositions) {
  // From the first 127, positions at an opposite could not be told apart.
  Places places = near_origins(127, 1e-7);
  const std::size_t before = places.x.size();
  for (const double more : {2e-4, 4e-4}) {
    places.x.push_back(places.x[400] + 180 + more);
    places.y.push_back(-places.y[400]);
  }
  const auto found = cf::triangulate(places.x, places.y);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->repeated, 0U);
  EXPECT_EQ(triangles_in(found->mesh) + found->gaps, 2 * (before + 2) - 4);
}

TEST(Delaunay, PositionsThatNoChartTellsApartAreRefused) {
  const Places places = near_origins(128, 1e-7);
  const auto found = cf::triangulate(places.x, places.y);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("cannot be told apart"));
}

// Most edges of a row of positions beside a wide gap lead across it.
TEST(Delaunay, GapsAreMaskedBesideNarrowRows) {
  for (const double width : {1.5, 2.0, 4.0}) {
    Places places;
    const auto add = [&](double x, double y) {
      places.x.push_back(x + 1e-4 * std::sin(37.0 * static_cast<double>(places.x.size())));
      places.y.push_back(y + 1e-4 * std::cos(53.0 * static_cast<double>(places.x.size())));
    };
    for (int n = 0; n < 400; ++n) add(20 + 0.1 * (n % 20), 10 + 0.1 * (n / 20));
    for (int n = 0; n < 40; ++n) add(21.9 + width + 0.1 * (n % 2), 10 + 0.1 * (n / 2));
    const auto found = cf::triangulate(places.x, places.y);
    ASSERT_TRUE(found) << found.error().message;
    for (std::size_t c = 0; c < found->mesh.cells(); ++c) {
      bool left = false;
      bool right = false;
      for (std::uint32_t i = found->mesh.first[c]; i < found->mesh.first[c + 1]; ++i) {
        (found->mesh.corners[i] < 400 ? left : right) = true;
      }
      EXPECT_FALSE(left && right) << width;
    }
  }
}

TEST(Delaunay, LongitudesOfAPoleAreOnePosition) {
  const auto found = cf::triangulate(random_places(400).x, Table(400, 90));
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("1 different positions: at least 100"));
}

TEST(Delaunay, PositionsAlongLinesFewOnesAndThoseOffTheGlobeAreRefused) {
  Places track;
  for (int n = 0; n < 400; ++n) {
    track.x.push_back(10 + 0.01 * n + 1e-5 * (n * n % 7));
    track.y.push_back(40 + 8 * std::sin(0.01 * n));
  }
  const auto lines = cf::triangulate(track.x, track.y);
  ASSERT_FALSE(lines);
  EXPECT_THAT(lines.error().message, HasSubstr("lie along lines"));

  const auto same = cf::triangulate(Table(400, 5), Table(400, 6));
  ASSERT_FALSE(same);
  EXPECT_THAT(same.error().message, HasSubstr("1 different positions: at least 100"));

  Places beyond = spiral(200);
  beyond.y[9] = 91;
  const auto off = cf::triangulate(beyond.x, beyond.y);
  ASSERT_FALSE(off);
  EXPECT_THAT(off.error().message, HasSubstr("entry 10 of a list of cells"));
}

class CentersOfCells : public testing::Test {
 protected:
  // A file of CAM-SE's shape: values on `ncol`, which a linear function of the position gives.
  void write(const Places& places, const Table& values) {
    NetcdfMaker file(folder_ / "c.nc");
    const int column = file.dimension("ncol", places.x.size());
    file.text(file.variable("lon", NC_DOUBLE, {column}, places.x), "units", "degrees_east");
    file.text(file.variable("lat", NC_DOUBLE, {column}, places.y), "units", "degrees_north");
    file.number(file.variable("T", NC_FLOAT, {column}, values), "_FillValue", NC_FLOAT, {-9});
  }
  static double linear(double x, double y) { return 100 + x - 2 * y; }
  static Table linear_at(const Places& places) {
    Table out;
    for (std::size_t n = 0; n < places.x.size(); ++n) {
      out.push_back(linear(places.x[n], places.y[n]));
    }
    return out;
  }

  Folder folder_;
};

TEST_F(CentersOfCells, LinearFunctionsAreExactAndGapsAndMissingValuesMasked) {
  // Every tenth of a degree, shaken, with a hole of 2 x 2 degrees; one value is missing.
  Places places;
  std::mt19937 random(3);
  for (int n = 0; n < 60 * 60; ++n) {
    const double x = 20 + 0.1 * (n % 60) + 1e-11 * static_cast<double>(random());
    const double y = 10 + 0.1 * (n / 60) + 1e-11 * static_cast<double>(random());
    if (std::abs(x - 23) < 1 && std::abs(y - 13) < 1) continue;
    places.x.push_back(x);
    places.y.push_back(y);
  }
  Table values = linear_at(places);
  values[65] = -9;  // at 20.5, 10.1
  write(places, values);
  const auto source = opened(folder_ / "c.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(has_note(source->info(), "Delaunay triangulation"));
  EXPECT_TRUE(has_note(source->info(), "rms error"));
  const Volume volume = volume_of(*source, "T");
  const auto& axes = source->info().grid.axes;
  const std::size_t width = axes[0].coordinates.size();
  std::size_t compared = 0;
  for (std::size_t n = 0; n < volume.values.size(); ++n) {
    const double x = axes[0].coordinates[n % width];
    const double y = axes[1].coordinates[n / width];
    const double from_hole = std::max(std::abs(x - 23), std::abs(y - 13));
    const double from_missing = std::max(std::abs(x - 20.5), std::abs(y - 10.1));
    if (from_hole < 0.6 || from_missing < 0.03) {
      ASSERT_TRUE(std::isnan(volume.values[n])) << x << ' ' << y;
    } else if (from_hole > 1.1 && from_missing > 0.2 && x > 20.1 && x < 25.8 && y > 10.1 &&
               y < 15.8) {
      ASSERT_NEAR(volume.values[n], linear(x, y), 1e-3) << x << ' ' << y;
      ++compared;
    }
  }
  EXPECT_GT(compared, 3000U);
}

TEST_F(CentersOfCells, AroundTheGlobeLeaveNoSampleMasked) {
  const Places places = spiral(2000);
  Table values;
  for (const double y : places.y) values.push_back(std::sin(y * degree));
  write(places, values);
  const auto source = opened(folder_ / "c.nc");
  ASSERT_NE(source, nullptr);
  const Volume volume = volume_of(*source, "T");
  const auto& axes = source->info().grid.axes;
  const std::size_t width = axes[0].coordinates.size();
  double worst = 0;
  for (std::size_t n = 0; n < volume.values.size(); ++n) {
    const double expected = std::sin(axes[1].coordinates[n / width] * degree);
    worst = std::max(worst, std::abs(static_cast<double>(volume.values[n]) - expected));
    ASSERT_FALSE(std::isnan(volume.values[n])) << n;
  }
  // The spacing is 0.08: a quadrilateral's diagonal squared over 8, and edges straight on the map.
  EXPECT_LT(worst, 3e-3);
}

TEST_F(CentersOfCells, AtDifferentTimesOrInRadiansAreRefused) {
  const Places places = spiral(500);
  // attribute, value: of one more variable along the list.
  const auto with = [&](const char* attribute, const std::string& value, const Table& times) {
    write(places, linear_at(places));
    int id = -1;
    int column = -1;
    int time = -1;
    EXPECT_EQ(nc_open((folder_ / "c.nc").c_str(), NC_WRITE, &id), NC_NOERR);
    nc_redef(id);
    nc_inq_dimid(id, "ncol", &column);
    nc_def_var(id, "moment", NC_DOUBLE, 1, &column, &time);
    nc_put_att_text(id, time, attribute, value.size(), value.c_str());
    nc_enddef(id);
    nc_put_var_double(id, time, times.data());
    EXPECT_EQ(nc_close(id), NC_NOERR);
  };
  const std::string hours = "hours since 2000-01-01";
  with("units", hours, counting(500));
  EXPECT_THAT(refusal(folder_ / "c.nc"), HasSubstr("'moment' tells them apart"));
  with("units", hours, Table(500, 3));
  EXPECT_NE(opened(folder_ / "c.nc"), nullptr);
  for (const char* role : {"trajectory_id", "profile_id"}) {
    with("cf_role", role, Table(500, 3));
    EXPECT_THAT(refusal(folder_ / "c.nc"), HasSubstr("those of trajectories or profiles")) << role;
  }
  with("cf_role", "timeseries_id", counting(500));  // of stations
  EXPECT_NE(opened(folder_ / "c.nc"), nullptr);

  Places radians = places;
  for (double& x : radians.x) x *= degree;
  for (double& y : radians.y) y *= degree;
  write(radians, linear_at(radians));
  EXPECT_THAT(refusal(folder_ / "c.nc"), HasSubstr("fill the range of radians"));
}

TEST_F(CentersOfCells, FewerThanAHundredAreRefusedAndNormalsOnEdgesToo) {
  const Places few = spiral(99);
  write(few, linear_at(few));
  EXPECT_THAT(refusal(folder_ / "c.nc"), HasSubstr("lists stations"));

  const Places many = spiral(500);
  {
    NetcdfMaker file(folder_ / "e.nc");
    const int edge = file.dimension("nEdges", many.x.size());
    file.text(file.variable("lonEdge", NC_DOUBLE, {edge}, many.x), "units", "degrees_east");
    file.text(file.variable("latEdge", NC_DOUBLE, {edge}, many.y), "units", "degrees_north");
    file.variable("u", NC_FLOAT, {edge}, linear_at(many));
  }
  EXPECT_THAT(refusal(folder_ / "e.nc"), HasSubstr("edges"));
}

// Sites that are listed twice, 1e-4 degrees apart, are drawn as if listed once: the triangles are
// those of the first list, not slivers that look like tracks.
TEST(Delaunay, SitesListedTwiceWithClosePositionsAreOne) {
  const Places once = random_places(500);
  Places twice = once;
  for (std::size_t n = 0; n < 500; ++n) {
    twice.x.push_back(once.x[n] + 1e-4);
    twice.y.push_back(once.y[n] - 1e-4);
  }
  const auto single = cf::triangulate(once.x, once.y);
  ASSERT_TRUE(single) << single.error().message;
  const auto found = cf::triangulate(twice.x, twice.y);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->near, 500U);
  EXPECT_LT(found->near_degrees, 0.01);
  EXPECT_EQ(found->repeated, 0U);
  EXPECT_EQ(found->mesh.cells(), single->mesh.cells());
  EXPECT_EQ(found->mesh.corners, single->mesh.corners);
}

TEST(Delaunay, TracksStayRefusedHoweverCloseTheirPositions) {
  Places track;
  for (std::size_t n = 0; n < 3000; ++n) {
    const auto along = static_cast<double>(n);
    track.x.push_back(10 + 1e-3 * along + 1e-7 * along * along);
    track.y.push_back(50 + 2e-3 * along);
  }
  const auto found = cf::triangulate(track.x, track.y);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("along lines"));
}

// A list of cells around 10 degrees east and 50 north, in the given units.
void write_cells(const std::string& path, const std::array<std::string, 2>& units, double scale) {
  constexpr std::size_t count = 200;
  NetcdfMaker file(path);
  const int cells = file.dimension("ncells", count);
  const Places around = spiral(count);
  std::vector<double> east;
  std::vector<double> north;
  for (std::size_t n = 0; n < count; ++n) {
    east.push_back(scale * (10 + around.x[n] / 90));
    north.push_back(scale * (50 + around.y[n] / 90));
  }
  for (const auto& [name, standard, values] :
       {std::tuple("tlon", "longitude", east), std::tuple("tlat", "latitude", north)}) {
    const int v = file.variable(name, NC_DOUBLE, {cells}, values);
    file.text(v, "standard_name", standard);
    const std::string& unit = units.at(name == std::string("tlon") ? 0 : 1);
    if (!unit.empty()) file.text(v, "units", unit);
  }
  const int z = file.axis("height", {10, 20}, "m", "height");
  const int t = file.variable("t", NC_FLOAT, {z, cells}, counting(2 * count));
  file.text(t, "coordinates", "tlat tlon");
}

TEST(Delaunay, RadiansOfARegionAreDegreesByTheirUnitsOnly) {
  const Folder folder;
  write_cells(folder / "r.nc", {"radian", "radian"}, degree);
  const auto source = opened(folder / "r.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_NEAR(source->info().grid.axes[0].coordinates.front(), 8, 0.3);
  EXPECT_NEAR(source->info().grid.axes[1].coordinates.back(), 51, 0.3);
  write_cells(folder / "d.nc", {}, 1);
  EXPECT_NE(opened(folder / "d.nc"), nullptr) << "50 and more are no radians";
  using Units = std::array<std::string, 2>;
  for (const Units& units : {Units{"", ""}, Units{"radian", ""}, Units{"", "radian"},
                             Units{"1", "1"}, Units{"-", "radian"}}) {
    write_cells(folder / "n.nc", units, degree);
    EXPECT_THAT(refusal(folder / "n.nc"),
                HasSubstr("the positions in 'tlon' and 'tlat' have no units and could be degrees "
                          "or radians"))
        << units[0] << ", " << units[1];
  }
  write_cells(folder / "one.nc", {"degrees_east", ""}, degree);
  EXPECT_NE(opened(folder / "one.nc"), nullptr) << "the other is in degrees by its units";
}

}  // namespace
}  // namespace windsplat::data::test::mesh
