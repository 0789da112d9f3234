// Time and place -> the direction of the sun.
#pragma once

#include <glm/vec3.hpp>

namespace windsplat::light {

struct SunDirection {
  double azimuth = 0;    // degrees clockwise from north (+y), east (+x) is 90
  double elevation = 0;  // degrees above the horizon
};

// Unit vector towards the sun: x east, y north, z up.
glm::dvec3 sun_vector(const SunDirection& direction);

// Where the sun is at the zenith, in degrees; longitude in [-180, 180).
struct SubsolarPoint {
  double longitude = 0;
  double latitude = 0;
};

// The low-precision formulas of the Astronomical Almanac (section C, "Low precision formulas for
// the Sun"; Greenwich sidereal time, section B): within 0.01 degrees from 1950 to 2050. No
// refraction, which lifts the sun by half a degree at the horizon. days: since 2000-01-01 12:00
// UTC.
SubsolarPoint subsolar_point(double days);
// Longitude and latitude in degrees.
SunDirection sun_direction(double days, double longitude, double latitude);

}  // namespace windsplat::light
