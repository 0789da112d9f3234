#include "server/light/sun.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace windsplat::light {

namespace {

constexpr double degree = std::numbers::pi / 180;

double sine(double degrees) { return std::sin(degrees * degree); }
double cosine(double degrees) { return std::cos(degrees * degree); }

}  // namespace

glm::dvec3 sun_vector(const SunDirection& direction) {
  const double level = cosine(direction.elevation);
  return {level * sine(direction.azimuth), level * cosine(direction.azimuth),
          sine(direction.elevation)};
}

SubsolarPoint subsolar_point(double days) {
  const double mean_longitude = 280.460 + 0.9856474 * days;
  const double anomaly = 357.528 + 0.9856003 * days;
  const double ecliptic = mean_longitude + 1.915 * sine(anomaly) + 0.020 * sine(2 * anomaly);
  const double obliquity = 23.439 - 4e-7 * days;
  const double right_ascension =
      std::atan2(cosine(obliquity) * sine(ecliptic), cosine(ecliptic)) / degree;
  const double sidereal_hours = 18.697374558 + 24.06570982441908 * days;
  SubsolarPoint point;
  point.latitude = std::asin(sine(obliquity) * sine(ecliptic)) / degree;
  const double east = right_ascension - 15 * sidereal_hours;
  point.longitude = east - 360 * std::floor((east + 180) / 360);
  return point;
}

SunDirection sun_direction(double days, double longitude, double latitude) {
  const SubsolarPoint point = subsolar_point(days);
  const double hour_angle = longitude - point.longitude;
  const double up = sine(latitude) * sine(point.latitude) +
                    cosine(latitude) * cosine(point.latitude) * cosine(hour_angle);
  const double east = -cosine(point.latitude) * sine(hour_angle);
  const double north = sine(point.latitude) * cosine(latitude) -
                       cosine(point.latitude) * cosine(hour_angle) * sine(latitude);
  SunDirection direction;
  direction.elevation = std::asin(std::clamp(up, -1.0, 1.0)) / degree;
  const double azimuth = std::atan2(east, north) / degree;
  direction.azimuth = azimuth < 0 ? azimuth + 360 : azimuth;
  return direction;
}

}  // namespace windsplat::light
