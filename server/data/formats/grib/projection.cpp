// Keys of ecCodes -> attributes of CF. x and y run from the first point, which PROJ places on the
// plane.
#include "server/data/formats/grib/projection.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include "server/data/cf/grid/projected_columns.hpp"

namespace windsplat::data::grib {

namespace {

// Keys in units of 1e-6 degree, of templates for which ecCodes has no key in degrees.
constexpr double micro = 1e-6;

class Description {
 public:
  Description(const Message& message, Grid& grid) : message_(message), grid_(grid) {}

  // Errors: bad_data with the reason as a predicate.
  Result<void> find() {
    grid_.projected = true;
    if (auto done = shape_earth(); !done) return done;
    const std::string& type = grid_.type;
    if (type == "transverse_mercator") {
      transverse_mercator();
      return check();
    }
    if (type == "lambert") {
      conic("lambert_conformal_conic", message_.number("LoVInDegrees"));
    } else if (type == "albers") {
      conic("albers_conical_equal_area", micro * message_.number("LoV"));
    } else if (type == "lambert_azimuthal_equal_area") {
      name("lambert_azimuthal_equal_area");
      put("latitude_of_projection_origin", message_.number("standardParallelInDegrees"));
      put("longitude_of_projection_origin", message_.number("centralLongitudeInDegrees"));
    } else if (type == "polar_stereographic") {
      polar_stereographic();
    } else {
      if (message_.number("orientationOfTheGridInDegrees") > 0) {
        return make_error(ErrorKind::bad_data, "is turned against the equator");
      }
      name("mercator");
      put("standard_parallel", message_.number("LaDInDegrees"));
      put("longitude_of_projection_origin", first("longitudeOfFirstGridPoint"));
    }
    return run_from_first();
  }

 private:
  void name(const char* kind) { grid_.mapping.texts["grid_mapping_name"] = kind; }
  void put(const char* attribute, double value) { grid_.mapping.numbers[attribute] = {value}; }

  Result<void> shape_earth() {
    if (message_.whole("earthIsOblate", 0) != 0) {
      put("semi_major_axis", message_.number("earthMajorAxisInMetres"));
      put("semi_minor_axis", message_.number("earthMinorAxisInMetres"));
      return {};
    }
    constexpr double radius_of_edition_1 = 6367470;
    const double radius = message_.number("radius");
    const bool is_first = message_.whole("edition", 2) == 1;
    if (std::isnan(radius) && !is_first) {
      return make_error(ErrorKind::bad_data, "gives no shape of the Earth");
    }
    put("earth_radius", std::isnan(radius) ? radius_of_edition_1 : radius);
    return {};
  }

  void conic(const char* kind, double longitude) {
    name(kind);
    const double first = message_.number("Latin1InDegrees");
    grid_.mapping.numbers["standard_parallel"] = {first, message_.number("Latin2InDegrees")};
    // Any origin will do: x and y are distances from the first point.
    put("latitude_of_projection_origin", first);
    put("longitude_of_central_meridian", longitude);
  }

  void polar_stereographic() {
    name("polar_stereographic");
    const double pole = message_.whole("southPoleOnProjectionPlane", 0) != 0 ? -90 : 90;
    put("latitude_of_projection_origin", pole);
    put("straight_vertical_longitude_from_pole", message_.number("orientationOfTheGridInDegrees"));
    put("standard_parallel", std::copysign(message_.number("LaDInDegrees"), pole));
  }

  void transverse_mercator() {
    name("transverse_mercator");
    put("latitude_of_projection_origin", message_.number("latitudeOfReferencePointInDegrees"));
    put("longitude_of_central_meridian", message_.number("longitudeOfReferencePointInDegrees"));
    put("scale_factor_at_central_meridian", message_.number("scaleFactorAtReferencePoint"));
    put("false_easting", message_.number("XRInMetres"));
    put("false_northing", message_.number("YRInMetres"));
    // Despite their names, in metres.
    run(message_.number("X1InGridLengths"), message_.number("DiInMetres"),
        message_.number("Y1InGridLengths"), message_.number("DjInMetres"));
  }

  // 1 or -1: `when_set` if the flag is set.
  [[nodiscard]] double signed_step(const char* flag, int when_set) const {
    return message_.whole(flag, 0) != 0 ? when_set : -when_set;
  }

  void run(double x, double step_x, double y, double step_y) {
    step_x *= signed_step("iScansNegatively", -1);
    step_y *= signed_step("jScansPositively", 1);
    for (std::size_t i = 0; i < grid_.columns; ++i) {
      grid_.x.push_back(x + static_cast<double>(i) * step_x);
    }
    for (std::size_t j = 0; j < grid_.rows; ++j) {
      grid_.y.push_back(y + static_cast<double>(j) * step_y);
    }
  }

  // Of edition 2 without a key in degrees, in microdegrees.
  [[nodiscard]] double first(const std::string& key) const {
    const double degrees = message_.number((key + "InDegrees").c_str());
    return std::isnan(degrees) ? micro * message_.number(key.c_str()) : degrees;
  }
  // Of Albers' template in millimetres.
  [[nodiscard]] double step(const char* metres, const char* millimetres) const {
    const double step = message_.number(metres);
    return std::isnan(step) ? 1e-3 * message_.number(millimetres) : step;
  }

  [[nodiscard]] Result<void> check() const {
    const auto projection = cf::projection_of(grid_.mapping);
    return projection ? Result<void>() : projection.error();
  }

  Result<void> run_from_first() {
    const auto projection = cf::projection_of(grid_.mapping);
    if (!projection) return projection.error();
    const double longitude = first("longitudeOfFirstGridPoint");
    const double latitude = first("latitudeOfFirstGridPoint");
    if (!(std::abs(latitude) <= 90) || !std::isfinite(longitude)) {
      return make_error(ErrorKind::bad_data, "has no first point");
    }
    const auto at = cf::project_place(*projection, longitude, latitude);
    if (!at) return at.error();
    run((*at)[0], step("DxInMetres", "Dx"), (*at)[1], step("DyInMetres", "Dy"));
    return {};
  }

  const Message& message_;
  Grid& grid_;
};

}  // namespace

void find_projection(const Message& message, Grid& grid) {
  const auto found = Description(message, grid).find();
  const auto finite = [](const std::vector<double>& axis) {
    return !axis.empty() && std::isfinite(axis.front()) && std::isfinite(axis.back()) &&
           (axis.size() < 2 || axis.front() != axis.back());
  };
  if (!found) {
    grid.problem =
        "on a grid of the type " + in_quotes(grid.type) + " that " + found.error().message;
  } else if (!finite(grid.x) || !finite(grid.y)) {
    grid.problem = "on a grid of the type " + in_quotes(grid.type) + " without distances of points";
  }
}

}  // namespace windsplat::data::grib
