// PROJ parses the text, and parameters are taken by their names.
#include "server/data/cf/grid/crs_wkt.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/cf/grid/proj_context.hpp"

namespace windsplat::data::cf {

namespace wkt {
namespace {

using Context = std::unique_ptr<PJ_CONTEXT, decltype(&proj_context_destroy)>;
using Object = std::unique_ptr<PJ, decltype(&proj_destroy)>;

Object held(PJ* object) { return {object, &proj_destroy}; }

// A parameter of EPSG and the attribute that it becomes.
struct Parameter {
  std::string_view epsg;
  const char* attribute;
  bool is_angle;  // degrees; otherwise metres, or a factor
};
constexpr Parameter latitude{"Latitude of natural origin", "latitude_of_projection_origin", true};
constexpr Parameter longitude{"Longitude of natural origin", "longitude_of_projection_origin",
                              true};
constexpr Parameter meridian{"Longitude of natural origin", "longitude_of_central_meridian", true};
constexpr Parameter false_latitude{"Latitude of false origin", "latitude_of_projection_origin",
                                   true};
constexpr Parameter false_meridian{"Longitude of false origin", "longitude_of_central_meridian",
                                   true};
constexpr Parameter first{"Latitude of 1st standard parallel", "standard_parallel", true};
constexpr Parameter second{"Latitude of 2nd standard parallel", "standard_parallel", true};
constexpr Parameter parallel{"Latitude of 1st standard parallel", "standard_parallel", true};
constexpr Parameter from_pole{"Longitude of natural origin",
                              "straight_vertical_longitude_from_pole", true};
constexpr Parameter origin_from_pole{"Longitude of origin", "straight_vertical_longitude_from_pole",
                                     true};
constexpr Parameter polar_parallel{"Latitude of standard parallel", "standard_parallel", true};
constexpr Parameter scale{"Scale factor at natural origin", "scale_factor_at_projection_origin",
                          false};
constexpr Parameter meridian_scale{"Scale factor at natural origin",
                                   "scale_factor_at_central_meridian", false};
constexpr Parameter conic_scale{"Scale factor at natural origin", "", false};  // must be 1
constexpr Parameter satellite_height{"Satellite Height", "perspective_point_height", false};

struct Method {
  std::string_view epsg;
  const char* grid_mapping_name;
  std::array<Parameter, 4> parameters;  // without a name: none
};
constexpr auto methods = std::to_array<Method>({
    {"Lambert Conic Conformal (1SP)", "lambert_conformal_conic", {latitude, meridian, conic_scale}},
    {"Lambert Conic Conformal (2SP)",
     "lambert_conformal_conic",
     {false_latitude, false_meridian, first, second}},
    {"Albers Equal Area",
     "albers_conical_equal_area",
     {false_latitude, false_meridian, first, second}},
    {"Transverse Mercator", "transverse_mercator", {latitude, meridian, meridian_scale}},
    {"Lambert Azimuthal Equal Area", "lambert_azimuthal_equal_area", {latitude, longitude}},
    {"Mercator (variant A)", "mercator", {longitude, scale}},
    {"Mercator (variant B)", "mercator", {longitude, parallel}},
    {"Popular Visualisation Pseudo Mercator", "mercator", {longitude}},
    {"Polar Stereographic (variant A)", "polar_stereographic", {latitude, from_pole, scale}},
    {"Polar Stereographic (variant B)", "polar_stereographic", {polar_parallel, origin_from_pole}},
    {"Geostationary Satellite (Sweep X)", "geostationary", {longitude, satellite_height}},
    {"Geostationary Satellite (Sweep Y)", "geostationary", {longitude, satellite_height}},
});

class Reader {
 public:
  explicit Reader(PJ_CONTEXT* context) : context_(context) {}

  Result<GridMapping> read_text(const std::string& text) {
    return read(held(proj_create_from_wkt(context_, text.c_str(), nullptr, nullptr, nullptr)));
  }

  Result<GridMapping> read_code(int code) {
    source_ = "the EPSG code " + std::to_string(code);
    const char* const path = proj_context_get_database_path(context_);
    if (path == nullptr || *path == '\0') {
      return fault("alone, and the database of PROJ is not installed");
    }
    PJ* const crs = proj_create_from_database(context_, "EPSG", std::to_string(code).c_str(),
                                              PJ_CATEGORY_CRS, 0, nullptr);
    if (crs == nullptr) return fault("which the database of PROJ does not have");
    return read(held(crs));
  }

 private:
  Result<GridMapping> read(Object crs) {
    for (int depth = 0; crs && depth < 4; ++depth) {
      const PJ_TYPE type = proj_get_type(crs.get());
      if (type == PJ_TYPE_BOUND_CRS) {
        crs = held(proj_get_source_crs(context_, crs.get()));
        out_.numbers["towgs84"] = {std::nan("")};  // a shift, whose size is not read
      } else if (type == PJ_TYPE_COMPOUND_CRS) {
        crs = held(proj_crs_get_sub_crs(context_, crs.get(), 0));
      }
    }
    if (!crs) return fault("that PROJ does not understand");
    const PJ_TYPE type = proj_get_type(crs.get());
    const bool is_geographic =
        type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
    if (!is_geographic && type != PJ_TYPE_PROJECTED_CRS) {
      return fault("of a system that is neither geographic nor projected");
    }
    if (is_geographic && proj_crs_is_derived(context_, crs.get()) != 0) {
      return fault(
          "of a derived geographic system, such as one with a "
          "rotated pole, which is not read");
    }
    if (auto done = shape(crs.get()); !done) return done.error();
    if (is_geographic) {
      out_.texts["grid_mapping_name"] = "latitude_longitude";
      return std::move(out_);
    }
    const Object conversion = held(proj_crs_get_coordoperation(context_, crs.get()));
    if (!conversion) return fault("without a conversion");
    if (auto done = convert(conversion.get()); !done) return done.error();
    return std::move(out_);
  }

  [[nodiscard]] Error fault(const std::string& what) const {
    return make_error(ErrorKind::bad_data, "has " + source_ + ' ' + what);
  }

  void set(const char* attribute, double value) { out_.numbers[attribute].push_back(value); }

  Result<void> shape(PJ* crs) {
    const Object ellipsoid = held(proj_get_ellipsoid(context_, crs));
    double semi_major = 0;
    double inverse_flattening = 0;
    if (!ellipsoid || proj_ellipsoid_get_parameters(context_, ellipsoid.get(), &semi_major, nullptr,
                                                    nullptr, &inverse_flattening) == 0) {
      return fault("without an ellipsoid");
    }
    set("semi_major_axis", semi_major);
    if (inverse_flattening > 0) set("inverse_flattening", inverse_flattening);
    const Object prime = held(proj_get_prime_meridian(context_, crs));
    double longitude_of_prime = 0;
    double unit = 0;  // radians
    if (prime && proj_prime_meridian_get_parameters(context_, prime.get(), &longitude_of_prime,
                                                    &unit, nullptr) != 0) {
      const double degrees = longitude_of_prime * unit * 180 / std::numbers::pi;
      if (degrees != 0) set("longitude_of_prime_meridian", degrees);
    }
    return {};
  }

  // The value of a parameter in radians, metres or as a factor.
  std::optional<double> parameter(PJ* conversion, std::string_view name) {
    const int count = proj_coordoperation_get_param_count(context_, conversion);
    for (int n = 0; n < count; ++n) {
      const char* found = nullptr;
      double value = 0;
      double unit = 1;
      if (proj_coordoperation_get_param(context_, conversion, n, &found, nullptr, nullptr, &value,
                                        nullptr, &unit, nullptr, nullptr, nullptr, nullptr) == 0 ||
          found == nullptr || name != found) {
        continue;
      }
      return value * unit;
    }
    return std::nullopt;
  }

  Result<void> convert(PJ* conversion) {
    const char* name = nullptr;
    proj_coordoperation_get_method_info(context_, conversion, &name, nullptr, nullptr);
    const std::string_view method = name == nullptr ? "" : name;
    const auto* const known = std::find_if(methods.begin(), methods.end(),
                                           [&](const Method& one) { return one.epsg == method; });
    if (known == methods.end()) {
      return fault("of the unknown conversion " + in_quotes(std::string(method)));
    }
    out_.texts["grid_mapping_name"] = known->grid_mapping_name;
    for (const Parameter& wanted : known->parameters) {
      if (wanted.epsg.empty()) continue;
      const auto value = parameter(conversion, wanted.epsg);
      if (!value) {
        return fault("without the parameter " + in_quotes(std::string(wanted.epsg)));
      }
      if (std::string_view(wanted.attribute).empty()) {
        if (*value == 1) continue;
        return fault("of a cone with a scale factor other than 1");
      }
      set(wanted.attribute, wanted.is_angle ? *value * 180 / std::numbers::pi : *value);
    }
    for (const auto& [epsg, attribute] :
         {std::pair("False easting", "false_easting"),
          std::pair("False northing", "false_northing"),
          std::pair("Easting at false origin", "false_easting"),
          std::pair("Northing at false origin", "false_northing")}) {
      if (const auto value = parameter(conversion, epsg)) set(attribute, *value);
    }
    add_implied(method);
    return {};
  }

  // What the method itself says.
  void add_implied(std::string_view method) {
    if (method == "Lambert Conic Conformal (1SP)") {
      out_.numbers["standard_parallel"] = out_.numbers["latitude_of_projection_origin"];
    } else if (method == "Popular Visualisation Pseudo Mercator") {
      out_.numbers.erase("inverse_flattening");  // a sphere
      set("standard_parallel", 0);
    } else if (method == "Polar Stereographic (variant B)") {
      const double side = out_.numbers["standard_parallel"].front() < 0 ? -90 : 90;
      set("latitude_of_projection_origin", side);
    } else if (method.starts_with("Geostationary")) {
      set("latitude_of_projection_origin", 0);
      out_.texts["sweep_angle_axis"] = method.ends_with("X)") ? "x" : "y";
    }
  }

  PJ_CONTEXT* context_;
  std::string source_ = "well-known text";  // for messages
  GridMapping out_;
};

}  // namespace
}  // namespace wkt

Result<GridMapping> mapping_of_wkt(const std::string& text) {
  const wkt::Context context(context_without_files(), &proj_context_destroy);
  if (!context) return make_error(ErrorKind::out_of_memory, "cannot be read: no memory");
  return wkt::Reader(context.get()).read_text(text);
}

std::optional<int> epsg_code_of(const std::string& text) {
  std::string_view digits = text;
  for (const std::string_view prefix : {"EPSG:", "epsg:", "urn:ogc:def:crs:EPSG::"}) {
    if (digits.starts_with(prefix)) digits.remove_prefix(prefix.size());
  }
  int code = 0;
  const auto [end, fault] = std::from_chars(digits.data(), digits.data() + digits.size(), code);
  const bool is_whole = fault == std::errc() && end == digits.data() + digits.size();
  return is_whole && code > 0 ? std::optional(code) : std::nullopt;
}

Result<GridMapping> mapping_of_epsg(int code) {
  const std::string folder = projection_database_folder();
  const wkt::Context context(context_with_database(folder), &proj_context_destroy);
  if (!context) return make_error(ErrorKind::out_of_memory, "cannot be read: no memory");
  return wkt::Reader(context.get()).read_code(code);
}

std::string projection_database_folder() {
  // Without PROJ, which would take megabytes in a process that needs nothing else of it.
  std::vector<std::string> folders;
  const auto add = [&](const char* name, const char* within) {
    const char* const value = std::getenv(name);
    if (value == nullptr) return;
    std::istringstream parts{value};
    for (std::string folder; std::getline(parts, folder, ':');) {
      if (!folder.empty()) folders.push_back(folder + within);
    }
  };
  add("PROJ_DATA", "");
  add("PROJ_LIB", "");
  add("HOME", "/.local/share/proj");
  folders.emplace_back("/usr/share/proj");
  for (const std::string& folder : folders) {
    std::error_code fault;
    const auto whole = std::filesystem::absolute(folder, fault);
    if (!fault && std::filesystem::is_regular_file(whole / "proj.db", fault)) return whole.string();
  }
  return {};
}

}  // namespace windsplat::data::cf
