// The place of the sun against published values, and the phase function.
#include "server/light/sun.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "protocol/utc_time.hpp"
#include "server/light/shade.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

double days(const char* utc) { return protocol::days_since_2000(utc).value(); }

// J. Meeus: Astronomical Algorithms, 1991, examples 24.a and 27.a: on 1992 October 13 at 0 h the
// declination is -7.785 degrees and the equation of time 13 min 42.7 s.
TEST(Sun, AgreesWithTheAstronomicalAlgorithms) {
  const auto point = light::subsolar_point(days("1992-10-13T00:00:00Z"));
  EXPECT_NEAR(point.latitude, -7.785, 0.01);
  EXPECT_NEAR(point.longitude, 180 - (13 + 42.7 / 60) / 4, 0.015);
}

// Solstices and equinoxes of 2024 by the US Naval Observatory: June 20 20:51, December 21 9:21,
// March 20 3:06, September 22 12:44 UTC.
TEST(Sun, IsOverTheTropicsAtSolsticesAndOverTheEquatorAtEquinoxes) {
  EXPECT_NEAR(light::subsolar_point(days("2024-06-20T20:51Z")).latitude, 23.44, 0.01);
  EXPECT_NEAR(light::subsolar_point(days("2024-12-21T09:21Z")).latitude, -23.44, 0.01);
  EXPECT_NEAR(light::subsolar_point(days("2024-03-20T03:06Z")).latitude, 0, 0.01);
  EXPECT_NEAR(light::subsolar_point(days("2024-09-22T12:44Z")).latitude, 0, 0.01);
}

// Published times of sunrise are those of an elevation of -0.833 degrees, by refraction and the
// sun's radius, to a minute: London (51.51 N, 0.13 W), 2024 June 21, 3:43 UTC; Sydney (33.87 S,
// 151.21 E), 2024 December 21, 18:41 UTC of the day before.
TEST(Sun, RisesAtPublishedTimes) {
  const auto london = light::sun_direction(days("2024-06-21T03:43:00Z"), -0.13, 51.51);
  EXPECT_NEAR(london.elevation, -0.833, 0.15);
  EXPECT_NEAR(london.azimuth, 49, 1);
  const auto sydney = light::sun_direction(days("2024-12-20T18:41:00Z"), 151.21, -33.87);
  EXPECT_NEAR(sydney.elevation, -0.833, 0.25);
  EXPECT_NEAR(sydney.azimuth, 119, 1.5);
}

TEST(Sun, IsAtTheZenithOfTheSubsolarPoint) {
  const double at = days("2024-05-05T07:30:00Z");
  const auto point = light::subsolar_point(at);
  EXPECT_NEAR(light::sun_direction(at, point.longitude, point.latitude).elevation, 90, 1e-5);
}

TEST(Sun, AzimuthsAreClockwiseFromNorth) {
  const auto near = [](const glm::dvec3& a, const glm::dvec3& b) {
    return glm::length(a - b) < 1e-12;
  };
  EXPECT_TRUE(near(light::sun_vector({0, 0}), {0, 1, 0}));
  EXPECT_TRUE(near(light::sun_vector({90, 0}), {1, 0, 0}));
  EXPECT_TRUE(near(light::sun_vector({-90, 0}), {-1, 0, 0}));
  EXPECT_TRUE(near(light::sun_vector({180, 90}), {0, 0, 1}));
}

TEST(UtcTime, CountsDaysAndRefusesOthers) {
  EXPECT_EQ(days("2000-01-01T12:00:00Z"), 0);
  EXPECT_EQ(days("2000-03-01T00:00Z"), 59.5);
  EXPECT_NEAR(days("1999-12-31T12:00:01Z"), -1 + 1.0 / 86400, 1e-12);
  for (const char* text :
       {"", "2024-06-21", "2024-06-21T12:00:00", "2023-02-29T12:00:00Z", "2024-13-01T12:00:00Z",
        "2024-06-21T24:00:00Z", "2024-06-21 12:00:00Z"}) {
    EXPECT_FALSE(protocol::days_since_2000(text)) << text;
  }
}

TEST(Phase, HasAMeanOfOneAndStaysWithinItsBound) {
  for (const double g : {-0.99, -0.5, 0.0, 0.3, 0.9, 0.99}) {
    constexpr int steps = 400000;
    double sum = 0;
    const double most = (1 + std::abs(g)) / ((1 - std::abs(g)) * (1 - std::abs(g)));
    for (int n = 0; n < steps; ++n) {
      const double value = light::phase(g, -1 + 2 * (n + 0.5) / steps);
      EXPECT_LE(value, most * (1 + 1e-12));
      sum += value / steps;
    }
    EXPECT_NEAR(sum, 1, 1e-3) << g;
    EXPECT_NEAR(light::phase(g, g > 0 ? 1 : -1), most, 1e-9 * most);
  }
}

TEST(Phase, NoFactorExceedsOneWhateverTheSun) {
  scene::Scene scene;
  scene::ScalarLayer layer;
  for (const bool perspective : {false, true}) {
    scene.camera = look({0, 0, 0}, {0, 1, 0}, 3, 8, 8, perspective, 1);
    for (const double g : {-0.99, 0.0, 0.99}) {
      for (const double strength : {0.0, 1.0, 1e6}) {
        scene.light = scene::Light{{0, 1, 0}, 0.25, strength, g, 1, {}};
        for (const double y : {0.0, 1e-30, -1.0, 1.0}) {
          const double sun = light::sun_seen(scene, {0, y, 0});
          const double factor = light::medium_light(*scene.light, layer, 0, sun);
          EXPECT_GE(factor, 0.25);
          EXPECT_LE(factor, 1);
        }
      }
    }
  }
}

}  // namespace
}  // namespace windsplat::test
