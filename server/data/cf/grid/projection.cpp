// One function for each projection, in a table by name; every attribute is checked against its
// range before PROJ sees it.
#include "server/data/cf/grid/projection.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"

namespace windsplat::data::cf {

namespace {

struct Limits {
  double low;
  double high;
};
constexpr Limits latitudes{-90, 90};
constexpr Limits longitudes{-720, 720};
constexpr Limits distances{-1e9, 1e9};
constexpr Limits radii{1e5, 1e9};  // from small moons to stars
constexpr Limits heights{1e3, 1e12};
constexpr Limits scales{1e-3, 1e3};

std::string digits(double value) {
  std::array<char, 32> out{};
  const auto end = std::to_chars(out.data(), out.data() + out.size(), value).ptr;
  return {out.data(), end};
}

// The attributes of a grid mapping. The first one that is missing or impossible becomes the fault.
class Attributes {
 public:
  using Names = std::initializer_list<const char*>;

  explicit Attributes(const GridMapping& mapping) : mapping_(mapping) {}

  // The first of the attributes that is present.
  std::optional<double> find(Names names, Limits range) {
    for (const char* name : names) {
      const auto& values = numbers(name);
      if (values.empty()) continue;
      if (values.size() == 1) return checked(name, values[0], range);
      fail(std::string("has more than one ") + name);
      return std::nullopt;
    }
    return std::nullopt;
  }
  double get(Names names, Limits range) {
    const auto value = find(names, range);
    if (!value) fail(std::string("lacks its attribute ") + *names.begin());
    return value.value_or(0);
  }
  double get_or(Names names, Limits range, double otherwise) {
    return find(names, range).value_or(otherwise);
  }
  // One or two numbers.
  std::vector<double> parallels() {
    auto values = numbers("standard_parallel");
    if (values.empty() || values.size() > 2) fail("lacks its attribute standard_parallel");
    for (const double value : values) checked("standard_parallel", value, latitudes);
    values.resize(2, values.empty() ? 0 : values[0]);
    return values;
  }
  // Empty if it is absent.
  [[nodiscard]] const std::vector<double>& numbers(const char* name) const {
    static const std::vector<double> none;
    const auto found = mapping_.numbers.find(name);
    return found == mapping_.numbers.end() ? none : found->second;
  }
  [[nodiscard]] std::string text(const char* name) const {
    const auto found = mapping_.texts.find(name);
    return found == mapping_.texts.end() ? "" : lower(found->second);
  }
  void fail(std::string reason) {
    if (fault_.empty()) fault_ = std::move(reason);
  }
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  std::optional<double> checked(const char* name, double value, Limits range) {
    if (value >= range.low && value <= range.high) return value;
    fail(std::string("has an impossible ") + name + ": " + digits(value));
    return std::nullopt;
  }

  const GridMapping& mapping_;
  std::string fault_;
};

void add(Projection& out, const char* parameter, double value) {
  out.definition += std::string(" +") + parameter + '=' + digits(value);
}

struct Ellipsoid {
  std::string_view name;
  double semi_major_m;
  double inverse_flattening;
};
// EPSG's parameters of the ellipsoids that CF names without numbers.
constexpr auto known_ellipsoids = std::to_array<Ellipsoid>({
    {"wgs 84", 6378137, 298.257223563},
    {"wgs84", 6378137, 298.257223563},
    {"grs 1980", 6378137, 298.257222101},
    {"grs80", 6378137, 298.257222101},
    {"wgs 72", 6378135, 298.26},
    {"international 1924", 6378388, 297},
    {"bessel 1841", 6377397.155, 299.1528128},
    {"airy 1830", 6377563.396, 299.3249646},
    {"clarke 1866", 6378206.4, 294.9786982139006},
    {"krassowsky 1940", 6378245, 298.3},
});

// WMO's mean radius (GRIB 2, code table 3.2, entry 6).
constexpr double usual_radius_m = 6371229;

void shape_earth(Attributes& from, Projection& out) {
  auto semi_major = from.find({"semi_major_axis"}, radii);
  auto flattening = from.find({"inverse_flattening"}, {0, 1e12});
  const auto semi_minor = from.find({"semi_minor_axis"}, {0, radii.high});
  const auto radius = from.find({"earth_radius"}, radii);
  if (!semi_major) semi_major = radius;
  if (!semi_major) {
    const std::string name = from.text("reference_ellipsoid_name");
    const auto* const known = std::find_if(known_ellipsoids.begin(), known_ellipsoids.end(),
                                           [&](const Ellipsoid& one) { return one.name == name; });
    if (known != known_ellipsoids.end()) {
      semi_major = known->semi_major_m;
      flattening = known->inverse_flattening;
    } else if (!name.empty()) {
      from.fail("names an ellipsoid without its axes: " + in_quotes(name));
    } else {
      semi_major = usual_radius_m;
      out.notes.push_back("gives no shape of the Earth: a sphere of " + digits(usual_radius_m) +
                          " m is assumed");
    }
  }
  out.radius_m = semi_major.value_or(usual_radius_m);
  const bool is_flat = flattening && *flattening > 0;
  if (!is_flat && semi_minor && *semi_minor > 0 && !flattening) {
    // Prolate bodies, and those flatter than any planet.
    if (*semi_minor > out.radius_m || *semi_minor < 0.5 * out.radius_m) {
      from.fail("has an impossible semi_minor_axis: " + digits(*semi_minor));
    }
    if (*semi_minor < out.radius_m) {
      add(out, "a", out.radius_m);
      add(out, "b", *semi_minor);
      return;
    }
  }
  if (is_flat && *flattening < 2) {
    from.fail("has an impossible inverse_flattening: " + digits(*flattening));
  }
  add(out, is_flat ? "a" : "R", out.radius_m);
  if (is_flat) add(out, "rf", *flattening);
}

bool is_sphere(const Projection& projection) {
  return projection.definition.find(" +R=") != std::string::npos;
}

void centre(Projection& out, double longitude) {
  add(out, "lon_0", longitude);
  out.central_longitude += longitude;
}

void albers(Attributes& from, Projection& out) {
  const auto parallels = from.parallels();
  out.definition += " +proj=aea";
  out.verified = true;
  add(out, "lat_1", parallels[0]);
  add(out, "lat_2", parallels[1]);
  add(out, "lat_0", from.get({"latitude_of_projection_origin"}, latitudes));
  centre(out, from.get({"longitude_of_central_meridian"}, longitudes));
}

void at_origin(Attributes& from, Projection& out, const char* projection) {
  out.definition += std::string(" +proj=") + projection;
  add(out, "lat_0", from.get({"latitude_of_projection_origin"}, latitudes));
  centre(out, from.get({"longitude_of_projection_origin"}, longitudes));
}

void azimuthal_equidistant(Attributes& from, Projection& out) {
  at_origin(from, out, "aeqd");
  out.verified = true;
}
void azimuthal_equal_area(Attributes& from, Projection& out) { at_origin(from, out, "laea"); }
void orthographic(Attributes& from, Projection& out) { at_origin(from, out, "ortho"); }

void geostationary(Attributes& from, Projection& out) {
  out.definition += " +proj=geos";
  if (from.get_or({"latitude_of_projection_origin"}, latitudes, 0) != 0) {
    from.fail("has a latitude_of_projection_origin other than 0");
  }
  out.metres_per_radian = from.get({"perspective_point_height"}, heights);
  add(out, "h", out.metres_per_radian);
  centre(out, from.get({"longitude_of_projection_origin"}, longitudes));
  const std::string sweep = from.text("sweep_angle_axis");
  const std::string fixed = from.text("fixed_angle_axis");
  if (sweep == "x" || (sweep.empty() && fixed == "y")) {
    out.definition += " +sweep=x";
  } else if (sweep == "y" || (sweep.empty() && fixed == "x")) {
    out.definition += " +sweep=y";
  } else {
    from.fail("lacks its attribute sweep_angle_axis");
  }
}

void conformal_conic(Attributes& from, Projection& out) {
  const auto parallels = from.parallels();
  out.definition += " +proj=lcc";
  add(out, "lat_1", parallels[0]);
  add(out, "lat_2", parallels[1]);
  add(out, "lat_0", from.get({"latitude_of_projection_origin"}, latitudes));
  centre(out, from.get({"longitude_of_central_meridian"}, longitudes));
}

// A standard parallel or a scale factor, whichever the file has.
void scale_at(Attributes& from, Projection& out, const char* parallel) {
  if (const auto latitude = from.find({"standard_parallel"}, latitudes)) {
    add(out, parallel, *latitude);
  } else {
    const auto scale = from.find({"scale_factor_at_projection_origin"}, scales);
    if (!scale) from.fail("lacks its attribute standard_parallel");
    add(out, "k_0", scale.value_or(1));
  }
}

void cylindrical_equal_area(Attributes& from, Projection& out) {
  out.definition += " +proj=cea";
  out.may_repeat = true;
  centre(out,
         from.get({"longitude_of_central_meridian", "longitude_of_projection_origin"}, longitudes));
  scale_at(from, out, "lat_ts");
}

void mercator(Attributes& from, Projection& out) {
  out.definition += " +proj=merc";
  out.may_repeat = true;
  centre(out,
         from.get({"longitude_of_projection_origin", "longitude_of_central_meridian"}, longitudes));
  scale_at(from, out, "lat_ts");
}

void oblique_mercator(Attributes& from, Projection& out) {
  out.definition += " +proj=omerc";
  out.verified = true;
  add(out, "alpha", from.get({"azimuth_of_central_line"}, {-360, 360}));
  add(out, "lat_0", from.get({"latitude_of_projection_origin"}, latitudes));
  const double longitude = from.get({"longitude_of_projection_origin"}, longitudes);
  add(out, "lonc", longitude);
  out.central_longitude += longitude;
  add(out, "k_0", from.get({"scale_factor_at_projection_origin"}, scales));
}

void polar_stereographic(Attributes& from, Projection& out) {
  out.definition += " +proj=stere";
  const double pole = from.get({"latitude_of_projection_origin"}, latitudes);
  if (std::abs(pole) != 90) from.fail("has its latitude_of_projection_origin not at a pole");
  add(out, "lat_0", pole);
  centre(out, from.get({"straight_vertical_longitude_from_pole", "longitude_of_projection_origin"},
                       longitudes));
  if (from.get_or({"standard_parallel"}, latitudes, pole) * pole < 0) {
    from.fail("has its standard_parallel in the other hemisphere");
  }
  scale_at(from, out, "lat_ts");
}

void rotated_pole(Attributes& from, Projection& out) {
  out.definition += " +proj=ob_tran +o_proj=longlat +R=1";
  out.in_degrees = true;
  add(out, "o_lat_p", from.get({"grid_north_pole_latitude"}, latitudes));
  add(out, "o_lon_p", from.get_or({"north_pole_grid_longitude"}, longitudes, 0));
  centre(out, 180 + from.get({"grid_north_pole_longitude"}, longitudes));
}

void sinusoidal(Attributes& from, Projection& out) {
  out.definition += " +proj=sinu";
  centre(out,
         from.get({"longitude_of_projection_origin", "longitude_of_central_meridian"}, longitudes));
}

void stereographic(Attributes& from, Projection& out) {
  at_origin(from, out, "stere");
  add(out, "k_0", from.get({"scale_factor_at_projection_origin"}, scales));
}

void transverse_mercator(Attributes& from, Projection& out) {
  // The algorithm is named because PROJ would take it from its configuration.
  out.definition += " +proj=tmerc +algo=poder_engsager";
  out.verified = true;
  add(out, "k_0", from.get({"scale_factor_at_central_meridian"}, scales));
  add(out, "lat_0", from.get({"latitude_of_projection_origin"}, latitudes));
  centre(out, from.get({"longitude_of_central_meridian"}, longitudes));
}

void vertical_perspective(Attributes& from, Projection& out) {
  at_origin(from, out, "nsper");
  add(out, "h", from.get({"perspective_point_height"}, heights));
  if (!is_sphere(out)) from.fail("is on an ellipsoid, for which PROJ has no such projection");
}

struct KnownProjection {
  std::string_view name;
  void (*describe)(Attributes&, Projection&);
};
constexpr auto known_projections = std::to_array<KnownProjection>({
    {"albers_conical_equal_area", albers},
    {"azimuthal_equidistant", azimuthal_equidistant},
    {"geostationary", geostationary},
    {"lambert_azimuthal_equal_area", azimuthal_equal_area},
    {"lambert_conformal_conic", conformal_conic},
    {"lambert_cylindrical_equal_area", cylindrical_equal_area},
    {"mercator", mercator},
    {"oblique_mercator", oblique_mercator},
    {"orthographic", orthographic},
    {"polar_stereographic", polar_stereographic},
    {"rotated_latitude_longitude", rotated_pole},
    {"sinusoidal", sinusoidal},
    {"stereographic", stereographic},
    {"transverse_mercator", transverse_mercator},
    {"vertical_perspective", vertical_perspective},
});

// Datum shifts, of up to some hundred metres, would need a database.
void tell_shift(const Attributes& from, Projection& out) {
  const auto& shift = from.numbers("towgs84");
  const bool any = std::any_of(shift.begin(), shift.end(), [](double v) { return v != 0; });
  if (any) out.notes.emplace_back("has a datum shift (towgs84), which is not applied");
}

}  // namespace

bool is_along_east(const std::string& grid_mapping_name) {
  constexpr auto along_east = std::to_array<std::string_view>(
      {"latitude_longitude", "mercator", "lambert_cylindrical_equal_area"});
  return is_one_of(grid_mapping_name, along_east);
}

double prime_meridian(const GridMapping& mapping) {
  return Attributes(mapping).get_or({"longitude_of_prime_meridian"}, {-360, 360}, 0);
}

GridMapping grid_mapping_at(const ArrayFile& file, int variable) {
  GridMapping out;
  for (const char* name : {"azimuth_of_central_line",
                           "earth_radius",
                           "false_easting",
                           "false_northing",
                           "grid_north_pole_latitude",
                           "grid_north_pole_longitude",
                           "inverse_flattening",
                           "latitude_of_projection_origin",
                           "longitude_of_central_meridian",
                           "longitude_of_prime_meridian",
                           "longitude_of_projection_origin",
                           "north_pole_grid_longitude",
                           "perspective_point_height",
                           "scale_factor_at_central_meridian",
                           "scale_factor_at_projection_origin",
                           "semi_major_axis",
                           "semi_minor_axis",
                           "standard_parallel",
                           "straight_vertical_longitude_from_pole",
                           "towgs84"}) {
    auto values = file.numbers(variable, name).values;
    if (!values.empty()) out.numbers.emplace(name, std::move(values));
  }
  for (const char* name :
       {"fixed_angle_axis", "grid_mapping_name", "reference_ellipsoid_name", "sweep_angle_axis"}) {
    auto text = file.text_of(variable, name);
    if (!text.empty()) out.texts.emplace(name, std::move(text));
  }
  return out;
}

Result<Projection> projection_of(const GridMapping& mapping) {
  Attributes from(mapping);
  Projection out;
  out.name = from.text("grid_mapping_name");
  const auto* const known =
      std::find_if(known_projections.begin(), known_projections.end(),
                   [&](const KnownProjection& one) { return one.name == out.name; });
  if (known == known_projections.end()) {
    return make_error(ErrorKind::bad_data, out.name.empty()
                                               ? "has no grid_mapping_name"
                                               : "is of the unknown kind " + in_quotes(out.name));
  }
  out.central_longitude = from.get_or({"longitude_of_prime_meridian"}, {-360, 360}, 0);
  if (out.central_longitude != 0) add(out, "pm", out.central_longitude);
  // Angles about a pole do not depend on the size of the sphere.
  constexpr std::string_view rotated = "rotated_latitude_longitude";
  if (out.name != rotated) shape_earth(from, out);
  known->describe(from, out);
  if (out.name != rotated) {
    out.origin_x_m = from.get_or({"false_easting"}, distances, 0);
    out.origin_y_m = from.get_or({"false_northing"}, distances, 0);
    add(out, "x_0", out.origin_x_m);
    add(out, "y_0", out.origin_y_m);
    out.definition += " +over";
  }
  tell_shift(from, out);
  if (!from.fault().empty()) return make_error(ErrorKind::bad_data, from.fault());
  out.definition.erase(0, 1);
  return out;
}

}  // namespace windsplat::data::cf
