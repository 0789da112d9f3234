// Places on the Earth of points in the world.
#include "server/ground/map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

namespace windsplat::ground {
namespace {

constexpr double radians = 3.14159265358979323846 / 180;

// Of the ways to the east and the north, against differences over a small step.
void expect_gradients(const Map& map, const glm::dvec3& point) {
  constexpr double h = 1e-6;
  const Located at = map.locate(point);
  const double shrink = std::cos(at.place.latitude * radians);
  for (int a = 0; a < 3; ++a) {
    glm::dvec3 step(0);
    step[a] = h;
    const Place high = map.locate(point + step).place;
    const Place low = map.locate(point - step).place;
    const double east = shrink * std::remainder(high.longitude - low.longitude, 360) / (2 * h);
    EXPECT_NEAR(at.east[a], east, 1e-6 * glm::length(at.east) + 1e-9);
    const double north = (high.latitude - low.latitude) / (2 * h);
    EXPECT_NEAR(at.north[a], north, 1e-6 * glm::length(at.north) + 1e-9);
  }
}

TEST(GroundMap, AGlobeHasItsDirections) {
  const Globe globe;
  for (const double latitude : {-80.0, -12.5, 0.0, 47.0, 89.0}) {
    for (const double longitude : {-179.0, -90.0, 0.0, 33.0, 120.0}) {
      const glm::dvec3 up(std::cos(latitude * radians) * std::sin(longitude * radians),
                          -std::cos(latitude * radians) * std::cos(longitude * radians),
                          std::sin(latitude * radians));
      const Located at = globe.locate(0.7 * up);
      EXPECT_NEAR(at.place.longitude, longitude, 1e-10);
      EXPECT_NEAR(at.place.latitude, latitude, 1e-10);
      EXPECT_LT(glm::distance(globe.up(0.7 * up), up), 1e-12);
      EXPECT_NEAR(glm::length(at.east), 1 / (0.7 * radians), 1e-9);
      EXPECT_NEAR(glm::dot(at.east, at.north), 0, 1e-9);
      expect_gradients(globe, 0.7 * up);
    }
  }
  EXPECT_EQ(globe.locate({0, 0, 1}).place.latitude, 90);
  EXPECT_EQ(globe.locate({0, 0, -2}).place.latitude, -90);
}

TEST(GroundMap, UnevenAxesAreInterpolated) {
  const AxesMap map({{350, 360, 380}, {-1, -0.5, 1}}, {{10, 30, 40}, {-1, 0, 0.5}});
  EXPECT_NEAR(map.locate({0.25, 0.25, 3}).place.longitude, 370, 1e-12);
  EXPECT_NEAR(map.locate({0.25, 0.25, 3}).place.latitude, 35, 1e-12);
  EXPECT_NEAR(map.locate({-1.25, 0.75, 0}).place.longitude, 345, 1e-12);
  EXPECT_NEAR(map.locate({-1.25, 0.75, 0}).place.latitude, 45, 1e-12);
  expect_gradients(map, {0.3, -0.3, 0});
}

// A Lambert conformal conic projection of a sphere with one standard parallel (J. P. Snyder, Map
// Projections, 1987, section 15), sampled every 12 km: between samples its own inverse.
TEST(GroundMap, ColumnsFollowTheirProjection) {
  constexpr double earth = 6371;
  constexpr double parallel = 45 * radians;
  const double n = std::sin(parallel);
  const double f = std::cos(parallel) * std::pow(std::tan(45 * radians + parallel / 2), n) / n;
  const double rho0 = earth * f / std::pow(std::tan(45 * radians + parallel / 2), n);
  const auto place_of = [&](double x, double y) {
    const double rho = std::hypot(x, rho0 - y);
    const double latitude = 2 * std::atan(std::pow(earth * f / rho, 1 / n)) - 90 * radians;
    return Place{10 + std::atan2(x, rho0 - y) / n / radians, latitude / radians};
  };
  Columns columns;
  auto longitudes = std::make_shared<std::vector<double>>();
  auto latitudes = std::make_shared<std::vector<double>>();
  for (int i = 0; i < 60; ++i) columns.x.push_back(-354 + 12.0 * i);
  for (int j = 0; j < 50; ++j) columns.y.push_back(-294 + 12.0 * j);
  for (const double y : columns.y) {
    for (const double x : columns.x) {
      longitudes->push_back(place_of(x, y).longitude);
      latitudes->push_back(place_of(x, y).latitude);
    }
  }
  columns.longitudes = longitudes;
  columns.latitudes = latitudes;
  const ColumnsMap map(columns);
  for (const auto& [x, y] : std::vector<std::array<double, 2>>{
           {0, 0}, {13.7, -201.3}, {-354, -294}, {359, 299}, {-341.5, 288.8}}) {
    const Place at = map.locate({x, y, 0}).place;
    EXPECT_NEAR(at.longitude, place_of(x, y).longitude, 2e-4) << x << ' ' << y;
    EXPECT_NEAR(at.latitude, place_of(x, y).latitude, 2e-4) << x << ' ' << y;
  }
  expect_gradients(map, {17.5, -33.1, 0});
}

}  // namespace
}  // namespace windsplat::ground
