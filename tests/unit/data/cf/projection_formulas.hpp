// Map projections of test files: forward formulas, and files on projected sheets. The formulas are
// those of J. P. Snyder, "Map Projections - A Working Manual" (USGS Professional Paper 1395, 1987;
// equation numbers below), and of the GOES-R product user's guide (volume 3, 5.1.2.8).
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/source.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::projected {

// Hides equal names of other tests.
inline constexpr double degree = std::numbers::pi / 180;

struct Mapping {
  std::string name;
  std::map<std::string, std::vector<double>> numbers;
  std::map<std::string, std::string> texts;
};

struct Sheet {
  std::vector<double> x;
  std::vector<double> y;
  std::string units = "m";
};

inline int write_mapping(NetcdfMaker& file, const Mapping& mapping) {
  const int crs = file.variable("crs", NC_INT, {}, {0});
  file.text(crs, "grid_mapping_name", mapping.name);
  for (const auto& [name, values] : mapping.numbers) {
    file.number(crs, name.c_str(), NC_DOUBLE, values);
  }
  for (const auto& [name, value] : mapping.texts) file.text(crs, name.c_str(), value);
  return crs;
}

// A file with a scalar f = 0, 1, 2, ... on the sheet.
inline void write_sheet(const std::string& path, const Mapping& mapping, const Sheet& sheet) {
  NetcdfMaker file(path, 0);
  const int y = file.axis("y", sheet.y, sheet.units, "projection_y_coordinate");
  const int x = file.axis("x", sheet.x, sheet.units, "projection_x_coordinate");
  write_mapping(file, mapping);
  const int f = file.variable("f", NC_FLOAT, {y, x}, counting(sheet.x.size() * sheet.y.size()));
  file.text(f, "grid_mapping", "crs");
}

struct Point {
  double x;
  double y;
};
// Longitude and latitude in degrees -> metres.
using Forward = std::function<Point(double, double)>;

struct Body {
  double a = 6378137;
  double e2 = 0;  // the square of the eccentricity
};
inline Body ellipsoid(double a, double inverse_flattening) {
  const double f = 1 / inverse_flattening;
  return {a, f * (2 - f)};
}
inline const Body wgs84 = ellipsoid(6378137, 298.257223563);
inline const Body hughes = ellipsoid(6378273, 298.279411123064);
inline const Body sphere{6371229, 0};

inline double m_of(const Body& body, double phi) {  // (14-15)
  return std::cos(phi) / std::sqrt(1 - body.e2 * std::pow(std::sin(phi), 2));
}
inline double t_of(const Body& body, double phi) {  // (15-9)
  const double e = std::sqrt(body.e2);
  return std::tan(M_PI / 4 - phi / 2) /
         std::pow((1 - e * std::sin(phi)) / (1 + e * std::sin(phi)), e / 2);
}
inline double q_of(const Body& body, double phi) {  // (3-12)
  const double s = std::sin(phi);
  if (body.e2 == 0) return 2 * s;
  const double e = std::sqrt(body.e2);
  return (1 - body.e2) *
         (s / (1 - body.e2 * s * s) - std::log((1 - e * s) / (1 + e * s)) / (2 * e));
}

inline double cone_of(const Body& body, double phi_1, double phi_2) {  // (15-8)
  if (phi_1 == phi_2) return std::sin(phi_1);
  return std::log(m_of(body, phi_1) / m_of(body, phi_2)) /
         std::log(t_of(body, phi_1) / t_of(body, phi_2));
}

inline Forward conformal_conic(Body body, double phi_1, double phi_2, double phi_0,
                               double lambda_0) {
  return [=](double lon, double lat) {  // (15-1) to (15-10)
    const double n = cone_of(body, phi_1 * degree, phi_2 * degree);
    const double f = m_of(body, phi_1 * degree) / (n * std::pow(t_of(body, phi_1 * degree), n));
    const double rho = body.a * f * std::pow(t_of(body, lat * degree), n);
    const double rho_0 = body.a * f * std::pow(t_of(body, phi_0 * degree), n);
    const double theta = n * std::remainder(lon - lambda_0, 360) * degree;
    return Point{rho * std::sin(theta), rho_0 - rho * std::cos(theta)};
  };
}

inline Forward polar(Body body, double pole, double phi_c, double lambda_0) {
  return [=](double lon, double lat) {  // (21-30) to (21-34)
    const double side = pole > 0 ? 1 : -1;
    const double way = side * std::remainder(lon - lambda_0, 360) * degree;
    const double rho = body.a * m_of(body, side * phi_c * degree) *
                       t_of(body, side * lat * degree) / t_of(body, side * phi_c * degree);
    return Point{side * rho * std::sin(way), -side * rho * std::cos(way)};
  };
}

inline Forward mercator(Body body, double phi_c, double lambda_0) {
  return [=](double lon, double lat) {  // (7-6), (7-7), times the scale of the parallel
    const double k = m_of(body, phi_c * degree);
    return Point{body.a * k * (lon - lambda_0) * degree,
                 -body.a * k * std::log(t_of(body, lat * degree))};
  };
}

inline Forward albers(Body body, double phi_1, double phi_2, double phi_0, double lambda_0) {
  return [=](double lon, double lat) {  // (14-1) to (14-14)
    const double m_1 = m_of(body, phi_1 * degree);
    const double m_2 = m_of(body, phi_2 * degree);
    const double q_1 = q_of(body, phi_1 * degree);
    const double n = (m_1 * m_1 - m_2 * m_2) / (q_of(body, phi_2 * degree) - q_1);
    const double c = m_1 * m_1 + n * q_1;
    const auto rho = [&](double phi) { return body.a * std::sqrt(c - n * q_of(body, phi)) / n; };
    const double theta = n * (lon - lambda_0) * degree;
    return Point{rho(lat * degree) * std::sin(theta),
                 rho(phi_0 * degree) - rho(lat * degree) * std::cos(theta)};
  };
}

inline Forward equal_area(Body body, double phi_1, double lambda_0) {
  return [=](double lon, double lat) {  // (24-17) to (24-20), (3-11), (3-13)
    const double q_p = q_of(body, M_PI / 2);
    const double beta = std::asin(q_of(body, lat * degree) / q_p);
    const double beta_1 = std::asin(q_of(body, phi_1 * degree) / q_p);
    const double r_q = body.a * std::sqrt(q_p / 2);
    const double d = body.a * m_of(body, phi_1 * degree) / (r_q * std::cos(beta_1));
    const double way = (lon - lambda_0) * degree;
    const double b = r_q * std::sqrt(2 / (1 + std::sin(beta_1) * std::sin(beta) +
                                          std::cos(beta_1) * std::cos(beta) * std::cos(way)));
    return Point{b * d * std::cos(beta) * std::sin(way),
                 b / d *
                     (std::cos(beta_1) * std::sin(beta) -
                      std::sin(beta_1) * std::cos(beta) * std::cos(way))};
  };
}

// The azimuthal projections of a sphere: k(cosine of the distance from the centre).
inline Forward azimuthal(double phi_1, double lambda_0, const std::function<double(double)>& k) {
  return [=](double lon, double lat) {  // (20-3), (21-2), (23-2), (25-3) and following
    const double phi = lat * degree;
    const double way = (lon - lambda_0) * degree;
    const double s = std::sin(phi_1 * degree);
    const double c = std::cos(phi_1 * degree);
    const double scale = sphere.a * k(s * std::sin(phi) + c * std::cos(phi) * std::cos(way));
    return Point{scale * std::cos(phi) * std::sin(way),
                 scale * (c * std::sin(phi) - s * std::cos(phi) * std::cos(way))};
  };
}

inline Forward transverse(Body body, double k_0, double lambda_0) {
  return [=](double lon, double lat) {  // (3-21), (8-9) to (8-15), from the equator
    const double phi = lat * degree;
    const double e2 = body.e2;
    const double ep2 = e2 / (1 - e2);
    const double n = body.a / std::sqrt(1 - e2 * std::pow(std::sin(phi), 2));
    const double t = std::pow(std::tan(phi), 2);
    const double c = ep2 * std::pow(std::cos(phi), 2);
    const double a = (lon - lambda_0) * degree * std::cos(phi);
    const double e4 = e2 * e2;
    const double e6 = e4 * e2;
    const double m = body.a * ((1 - e2 / 4 - 3 * e4 / 64 - 5 * e6 / 256) * phi -
                               (3 * e2 / 8 + 3 * e4 / 32 + 45 * e6 / 1024) * std::sin(2 * phi) +
                               (15 * e4 / 256 + 45 * e6 / 1024) * std::sin(4 * phi) -
                               35 * e6 / 3072 * std::sin(6 * phi));
    return Point{
        k_0 * n *
            (a + (1 - t + c) * std::pow(a, 3) / 6 +
             (5 - 18 * t + t * t + 72 * c - 58 * ep2) * std::pow(a, 5) / 120),
        k_0 * (m + n * std::tan(phi) *
                       (a * a / 2 + (5 - t + 9 * c + 4 * c * c) * std::pow(a, 4) / 24 +
                        (61 - 58 * t + t * t + 600 * c - 330 * ep2) * std::pow(a, 6) / 720))};
  };
}

// Metres: the angles of the guide, times the height. The other sweep exchanges the two angles.
inline Forward satellite(Body body, double height, double lambda_0, bool sweep_x) {
  return [=](double lon, double lat) {
    const double h = height + body.a;
    const double way = std::remainder(lon - lambda_0, 360) * degree;
    const double phi = std::atan((1 - body.e2) * std::tan(lat * degree));  // geocentric
    const double r =
        body.a * std::sqrt(1 - body.e2) / std::sqrt(1 - body.e2 * std::pow(std::cos(phi), 2));
    const double s_x = h - r * std::cos(phi) * std::cos(way);
    const double s_y = r * std::cos(phi) * std::sin(way);
    const double s_z = r * std::sin(phi);
    const double s = std::sqrt(s_x * s_x + s_y * s_y + s_z * s_z);
    return sweep_x ? Point{height * std::asin(s_y / s), height * std::atan(s_z / s_x)}
                   : Point{height * std::atan(s_y / s_x), height * std::asin(s_z / s)};
  };
}

using Numbers = std::map<std::string, std::vector<double>>;
inline Numbers with(const Body& body, Numbers numbers) {
  if (body.e2 == 0) {
    numbers["earth_radius"] = {body.a};
  } else {
    numbers["semi_major_axis"] = {body.a};
    numbers["inverse_flattening"] = {1 / (1 - std::sqrt(1 - body.e2))};
  }
  return numbers;
}
inline Numbers at_origin(double latitude, double longitude, Numbers more = {}) {
  more["latitude_of_projection_origin"] = {latitude};
  more["longitude_of_projection_origin"] = {longitude};
  return more;
}
inline Numbers conic(std::vector<double> parallels, double latitude, double longitude) {
  return {{"standard_parallel", std::move(parallels)},
          {"latitude_of_projection_origin", {latitude}},
          {"longitude_of_central_meridian", {longitude}}};
}

inline const Sheet wide{{-3e6, -1e6, 5e5, 2.5e6}, {-2e6, 1e5, 2e6}};
inline std::unique_ptr<Source> on_sheet(const Folder& folder, const Mapping& mapping,
                                        const Sheet& sheet = wide) {
  write_sheet(folder / "p.nc", mapping, sheet);
  return opened(folder / "p.nc");
}

inline const Mapping lambert{
    "lambert_conformal_conic", with(sphere, conic({38.5}, 38.5, -97.5)), {}};

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double infinite = std::numeric_limits<double>::infinity();

}  // namespace windsplat::data::test::projected
