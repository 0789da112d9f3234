// Evidence for the role and kind of axes, layout of variables, and orientation of axes.
#include "server/data/cf/grid/axes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/axis_names.hpp"
#include "server/data/cf/grid/cell_lists.hpp"
#include "server/data/cf/grid/longitudes.hpp"
#include "server/data/cf/time.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

bool is_north(std::string_view units) {
  constexpr auto known_units = std::to_array<std::string_view>(
      {"degrees_north", "degree_north", "degree_n", "degrees_n", "degreen", "degreesn"});
  return is_one_of(units, known_units);
}

bool is_angle(std::string_view units) {
  constexpr auto known_units = std::to_array<std::string_view>({"degrees", "degree", "deg"});
  return units.empty() || is_radian(units) || is_one_of(units, known_units);
}

// Units of depth used in oceanography.
bool is_ocean_pressure(std::string_view units) {
  constexpr auto known_units = std::to_array<std::string_view>({"dbar", "decibar", "decibars"});
  return is_one_of(units, known_units);
}

bool is_pressure(std::string_view units) { return pascals_in(units).has_value(); }
bool is_length(std::string_view units) { return metres_in(units).has_value(); }

bool is_level_unit(std::string_view units) {
  constexpr auto known_units =
      std::to_array<std::string_view>({"level", "layer", "sigma_level", "levels", "layers"});
  return is_one_of(units, known_units);
}

struct Evidence {
  Role role = Role::unknown;
  AxisKind kind = AxisKind::cartesian;
  bool kind_is_sure = false;
  bool positive_down = false;
};

struct Known {
  std::string_view text;
  Role role;
  AxisKind kind;
  bool positive_down;
};

Evidence evidence_of(const Known& known) {
  return {known.role, known.kind, true, known.positive_down};
}

Evidence by_standard_name(std::string_view name) {
  constexpr auto role_x = Role::x;
  constexpr auto role_y = Role::y;
  constexpr auto role_z = Role::z;
  constexpr auto known_names = std::to_array<Known>(
      {{"longitude", role_x, AxisKind::longitude, false},
       {"grid_longitude", role_x, AxisKind::longitude, false},
       {"projection_x_coordinate", role_x, AxisKind::cartesian, false},
       {"projection_x_angular_coordinate", role_x, AxisKind::cartesian, false},
       {"latitude", role_y, AxisKind::latitude, false},
       {"grid_latitude", role_y, AxisKind::latitude, false},
       {"projection_y_coordinate", role_y, AxisKind::cartesian, false},
       {"projection_y_angular_coordinate", role_y, AxisKind::cartesian, false},
       {"air_pressure", role_z, AxisKind::pressure, true},
       {"sea_water_pressure", role_z, AxisKind::depth, true},
       {"height", role_z, AxisKind::height, false},
       {"altitude", role_z, AxisKind::height, false},
       {"geopotential_height", role_z, AxisKind::height, false},
       {"depth", role_z, AxisKind::depth, true},
       {"model_level_number", role_z, AxisKind::level, false},
       {"atmosphere_sigma_coordinate", role_z, AxisKind::level, true},
       {"atmosphere_hybrid_sigma_pressure_coordinate", role_z, AxisKind::level, true},
       {"atmosphere_ln_pressure_coordinate", role_z, AxisKind::level, false},
       {"time", Role::time, AxisKind::cartesian, false}});
  const auto* at = std::find_if(known_names.begin(), known_names.end(),
                                [name](const Known& known) { return known.text == name; });
  if (at != known_names.end()) return evidence_of(*at);
  if (name.starts_with("height_above_")) {
    return {role_z, AxisKind::height, true, false};
  }
  if (name.starts_with("depth_below_")) {
    return {role_z, AxisKind::depth, true, true};
  }
  if ((name.starts_with("atmosphere_") || name.starts_with("ocean_")) &&
      name.ends_with("_coordinate")) {
    return {role_z, AxisKind::level, true, false};
  }
  if (name == "realization" || name.starts_with("forecast_")) {
    return {Role::other, AxisKind::cartesian, true, false};
  }
  return {};
}

Evidence by_units(std::string_view units) {
  if (is_east(units)) {
    return {Role::x, AxisKind::longitude, true, false};
  }
  if (is_north(units)) {
    return {Role::y, AxisKind::latitude, true, false};
  }
  if (is_ocean_pressure(units)) {
    return {Role::z, AxisKind::depth, true, true};
  }
  if (is_pressure(units)) {
    return {Role::z, AxisKind::pressure, true, true};
  }
  if (is_level_unit(units)) {
    return {Role::z, AxisKind::level, true, false};
  }
  if (units.find(" since ") != std::string_view::npos || units.starts_with("day as %")) {
    return {Role::time, AxisKind::cartesian, true, false};
  }
  return {};
}

// Names that do not say whether levels are numbers or heights.
bool is_plain_height(std::string_view name) {
  return is_one_of(name, std::to_array<std::string_view>({"z", "zc", "zt", "zm", "zdim"}));
}

Evidence by_name(std::string_view full_name, std::string_view units, bool has_coordinates) {
  const Role exact = role_of_name(full_name);
  const std::string_view name = exact == Role::unknown ? without_number(full_name) : full_name;
  Evidence found;
  found.role = exact == Role::unknown ? role_of_name(name) : exact;
  if (!has_coordinates) {
    return found;  // coordinates placed by index have no kind
  }
  if (found.role == Role::x && name.find("lon") != std::string_view::npos && is_angle(units)) {
    found.kind = AxisKind::longitude;
    found.kind_is_sure = true;
  } else if (found.role == Role::y && name.find("lat") != std::string_view::npos &&
             is_angle(units)) {
    found.kind = AxisKind::latitude;
    found.kind_is_sure = true;
  } else if (found.role == Role::z) {
    if (name.starts_with("depth") || name == "st_ocean") {
      found = {Role::z, AxisKind::depth, true, true};
    } else if (name.starts_with("pres") || name == "plev" || name == "isobaric") {
      found = {Role::z, AxisKind::pressure, true, true};
    } else if (name.starts_with("height") || name.starts_with("alt")) {
      found = {Role::z, AxisKind::height, true, false};
    } else if (!is_plain_height(name) && !is_length(units)) {
      // Sigma is 1 at the ground, and hybrid levels are numbered from the top.
      const bool from_top = name == "sigma" || name == "hybrid";
      found = {Role::z, AxisKind::level, true, from_top};
    }
  }
  return found;
}

Role role_of_axis_attribute(std::string_view axis) {
  if (axis == "x") return Role::x;
  if (axis == "y") return Role::y;
  if (axis == "z") return Role::z;
  return axis == "t" ? Role::time : Role::unknown;
}

// The strongest evidence determines the role; weaker evidence for the same role may determine the
// kind.
Evidence weigh(const std::vector<Evidence>& pieces) {
  Evidence out;
  for (const Evidence& piece : pieces) {
    if (out.role == Role::unknown) {
      out.role = piece.role;
    }
    if (piece.role == out.role && piece.kind_is_sure && !out.kind_is_sure) {
      out.kind = piece.kind;
      out.kind_is_sure = true;
      out.positive_down = piece.positive_down;
    }
  }
  return out;
}

Evidence by_attributes(const FileVariable& variable) {
  const std::string units = lower(variable.units);
  const std::string positive = lower(variable.positive);
  const bool is_vertical = positive == "up" || positive == "down";
  Evidence vertical;
  if (is_vertical) {
    vertical.role = Role::z;
    vertical.positive_down = positive == "down";
    if (is_length(units)) {
      vertical.kind = vertical.positive_down ? AxisKind::depth : AxisKind::height;
      vertical.kind_is_sure = true;
    }
  }
  Evidence axis;
  axis.role = role_of_axis_attribute(lower(variable.axis));
  return weigh({axis, by_standard_name(lower(variable.standard_name)), by_units(units), vertical});
}

// The coordinate variable of a dimension: the one with its name, otherwise a 1-D variable on it
// with the attributes of an axis.
int coordinate_of(const FileContents& contents, int dimension) {
  const std::string& name = contents.dimensions.at(static_cast<std::size_t>(dimension)).name;
  int marked = -1;
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& variable = contents.variables[v];
    if (variable.dims.size() != 1 || variable.dims[0] != dimension || !variable.numeric) continue;
    if (variable.name == name) {
      return static_cast<int>(v);
    }
    const std::string units = lower(variable.units);
    // WRF's XTIME ("minutes since ...") qualifies, but the reference time of a forecast does not.
    const bool tells_time =
        variable.standard_name.empty() && units.find(" since ") != std::string::npos;
    const bool says_axis = !variable.axis.empty() || is_east(units) || is_north(units) ||
                           tells_time ||
                           by_standard_name(lower(variable.standard_name)).role != Role::unknown;
    if (marked < 0 && says_axis) {
      marked = static_cast<int>(v);
    }
  }
  return marked;
}

// An explicit `positive` overrides the name; pressure always increases downward. ICON numbers its
// levels from the top.
void heed_positive(const FileVariable& variable, Evidence& found) {
  const std::string positive = lower(variable.positive);
  if (found.role == Role::z && (variable.units.empty() || variable.units == "1") &&
      lower(variable.long_name).starts_with("generalized")) {
    found = {Role::z, AxisKind::level, true, true};
  }
  if (found.role != Role::z || found.kind == AxisKind::pressure ||
      is_ocean_pressure(lower(variable.units)) || (positive != "up" && positive != "down")) {
    return;
  }
  found.positive_down = positive == "down";
  if (found.kind == AxisKind::height || found.kind == AxisKind::depth) {
    found.kind = found.positive_down ? AxisKind::depth : AxisKind::height;
  }
}

// Whether an axis is dimensionless sigma by name or unit only: 1 at the ground and 0 at the top in
// the atmosphere, 0 at the surface and -1 at the bottom in the ocean.
bool is_bare_sigma(const FileVariable& variable) {
  return variable.standard_name.empty() && variable.positive.empty() &&
         (without_number(lower(variable.name)) == "sigma" ||
          lower(variable.units) == "sigma_level");
}

// Direction of a vertical axis by its values if `positive` is absent, and its unit if it has none.
void heed_values(const FileVariable& variable, const std::vector<double>& coordinates,
                 AxisKind& kind, bool& positive_down, std::string& units, std::string& note) {
  const auto [low, high] = std::minmax_element(coordinates.begin(), coordinates.end());
  if (!variable.positive.empty() || low == coordinates.end()) return;
  const bool below_zero = *low < 0 && *high <= 0;
  if (kind == AxisKind::depth && positive_down && below_zero) {
    kind = AxisKind::height;
    positive_down = false;
    note = in_quotes(variable.name) + " has depths below 0: interpreted as heights";
  } else if (kind == AxisKind::level && is_bare_sigma(variable)) {
    const bool is_named = without_number(lower(variable.name)) == "sigma";
    constexpr double ground = 1.1;  // some models exceed 1 by half a layer
    positive_down = !below_zero && (is_named || (*low >= 0 && *high <= ground));
  } else if (kind == AxisKind::level && units.empty() && variable.standard_name.empty() &&
             coordinates.front() == *high && *low > 0 && *high >= 500 && *high <= 1100 &&
             *high - *low > static_cast<double>(coordinates.size())) {
    kind = AxisKind::pressure;
    positive_down = true;
    units = "hPa";
    note = in_quotes(variable.name) +
           " descends from 1100 or less and has no units: interpreted as pressures in hPa";
  }
}

DimensionRole classify(const FileContents& contents, int dimension) {
  DimensionRole out;
  out.coordinate = coordinate_of(contents, dimension);
  if (out.coordinate < 0) {
    out.coordinate = named_coordinate(contents, dimension);
    out.is_assumed = out.coordinate >= 0;
  }
  const FileDimension& self = contents.dimensions.at(static_cast<std::size_t>(dimension));
  std::vector<Evidence> pieces;
  std::string units;
  if (out.coordinate >= 0) {
    const FileVariable& variable = contents.variables[static_cast<std::size_t>(out.coordinate)];
    units = lower(variable.units);
    pieces.push_back(by_attributes(variable));
    pieces.push_back(by_name(lower(variable.name), units, true));
  }
  pieces.push_back(by_name(lower(self.name), units, out.coordinate >= 0));
  Evidence found = weigh(pieces);
  if (out.coordinate >= 0) {
    heed_positive(contents.variables[static_cast<std::size_t>(out.coordinate)], found);
  }
  out.role = self.other ? Role::other : self.is_time ? Role::time : found.role;
  out.kind = found.kind;
  out.kind_is_sure = found.kind_is_sure;
  out.positive_down = found.positive_down;
  return out;
}

// Assigns a dimension to a role; false if the role is already assigned.
bool assign_role(Layout& layout, Role role, int dimension) {
  int& place = role == Role::time ? layout.time
                                  : layout.space.at(role == Role::x   ? 0
                                                    : role == Role::y ? 1
                                                                      : 2);
  if (place >= 0) {
    return false;
  }
  place = dimension;
  return true;
}

// Angles without a unit that fill the range of radians: longitudes of a full turn, latitudes from
// pole to pole.
std::string note_on_radians(const FileVariable& variable, AxisKind kind,
                            const std::vector<double>& values) {
  const bool is_angle = kind == AxisKind::longitude || kind == AxisKind::latitude;
  if (!is_angle || !variable.units.empty() || values.size() < 8) return {};
  const double range = kind == AxisKind::longitude ? 2 * std::numbers::pi : std::numbers::pi;
  const double span = std::abs(values.back() - values.front());
  const double step = span / static_cast<double>(values.size() - 1);
  const auto fills = [&](double length) { return std::abs(length - range) <= 0.02 * range; };
  if (!fills(span) && !fills(span + step)) return {};
  return in_quotes(variable.name) + " has no unit and fills the range of radians: its values are " +
         "taken as degrees; the unit 'radian' would convert them";
}

Error bad_axis(const std::string& name, const std::string& what) {
  return make_error(ErrorKind::bad_data, "the coordinate '" + printable(name) + "' " + what);
}

}  // namespace

bool is_east(std::string_view units) {
  constexpr auto known_units = std::to_array<std::string_view>(
      {"degrees_east", "degree_east", "degree_e", "degrees_e", "degreee", "degreese"});
  return is_one_of(units, known_units);
}

bool is_radian(std::string_view units) {
  constexpr auto known_units = std::to_array<std::string_view>({"radian", "radians", "rad"});
  return is_one_of(lower(units), known_units);
}

bool is_position(const FileVariable& variable) {
  const std::string units = lower(variable.units);
  const std::string name = lower(variable.standard_name);
  return is_east(units) || is_north(units) || name == "longitude" || name == "latitude";
}

std::vector<DimensionRole> classify_dimensions(const FileContents& contents) {
  const std::vector<bool> lists = find_cell_lists(contents);
  std::vector<DimensionRole> out;
  for (std::size_t d = 0; d < contents.dimensions.size(); ++d) {
    out.push_back(classify(contents, static_cast<int>(d)));
    const bool is_place = out[d].role != Role::time && out[d].role != Role::z;
    if (lists[d] && is_place) out[d] = {.role = Role::other, .is_list = true};
  }
  return out;
}

int Layout::rank() const {
  return static_cast<int>(
      std::count_if(space.begin(), space.end(), [](int dimension) { return dimension >= 0; }));
}

Layout lay_out(const FileContents& contents, const std::vector<DimensionRole>& roles,
               const FileVariable& variable) {
  Layout layout;
  std::vector<int> unknown;
  const auto length_of = [&](int d) {
    return contents.dimensions.at(static_cast<std::size_t>(d)).length;
  };
  for (const int dimension : variable.dims) {
    const Role role = roles.at(static_cast<std::size_t>(dimension)).role;
    const std::size_t length = length_of(dimension);
    if (role == Role::unknown) {
      unknown.push_back(dimension);
    } else if (role == Role::other) {
      if (length != 1) {
        const FileDimension& self = contents.dimensions.at(static_cast<std::size_t>(dimension));
        layout.problem =
            roles.at(static_cast<std::size_t>(dimension)).is_list
                ? problem_of_list(self)
                : "its dimension '" + printable(self.name) + "' is neither space nor time";
        return layout;
      }
    } else if (length != 1 && !assign_role(layout, role, dimension)) {
      layout.problem = "two of its dimensions run along the same axis";
      return layout;
    }
  }
  // Dimensions of length 1 get the remaining roles, the last ones first, because time follows the
  // reference time of a forecast. Any further dimensions need no role.
  for (auto d = variable.dims.rbegin(); d != variable.dims.rend(); ++d) {
    const Role role = roles.at(static_cast<std::size_t>(*d)).role;
    if (length_of(*d) == 1 && role != Role::unknown && role != Role::other) {
      assign_role(layout, role, *d);
    }
  }
  if (!unknown.empty() && layout.time < 0 && unknown.front() == variable.dims.front() &&
      contents.dimensions.at(static_cast<std::size_t>(unknown.front())).unlimited) {
    layout.time = unknown.front();
    unknown.erase(unknown.begin());
  }
  const auto places = std::count(layout.space.begin(), layout.space.end(), -1);
  while (static_cast<std::ptrdiff_t>(unknown.size()) > places) {
    const auto single = std::find_if(unknown.begin(), unknown.end(),
                                     [&](int dimension) { return length_of(dimension) == 1; });
    if (single == unknown.end()) break;
    unknown.erase(single);
  }
  for (auto rest = unknown.rbegin(); rest != unknown.rend(); ++rest) {
    auto* place = std::find(layout.space.begin(), layout.space.end(), -1);
    if (place == layout.space.end()) {
      layout.problem = "it has more than three spatial dimensions";
      return layout;
    }
    *place = *rest;
  }
  return layout;
}

bool can_be_axis(std::vector<double> values, AxisKind kind) {
  const auto is_finite = [](double value) { return std::isfinite(value); };
  if (!std::all_of(values.begin(), values.end(), is_finite)) return false;
  if (kind == AxisKind::longitude) continue_over_seam(values);
  const bool rises = values.size() < 2 || values[1] > values[0];
  const auto is_wrong = [rises](double a, double b) { return rises ? !(b > a) : !(b < a); };
  return std::adjacent_find(values.begin(), values.end(), is_wrong) == values.end();
}

Result<OrientedAxis> orient_axis(const FileContents& contents, const DimensionRole& role,
                                 int dimension, int which, std::vector<double> coordinates,
                                 AxisKind horizontal) {
  OrientedAxis out;
  const FileDimension& self = contents.dimensions.at(static_cast<std::size_t>(dimension));
  out.axis.name = self.name;
  const bool by_index = coordinates.empty();
  if (by_index) {
    coordinates.resize(self.length);
    std::iota(coordinates.begin(), coordinates.end(), 0.0);
    out.axis.kind =
        which == 2 && horizontal != AxisKind::cartesian ? AxisKind::level : AxisKind::cartesian;
    out.axis.coordinates = std::move(coordinates);
    return out;
  }
  const FileVariable& variable = contents.variables.at(static_cast<std::size_t>(role.coordinate));
  out.axis.standard_name = variable.standard_name;
  out.axis.units = variable.units;
  out.axis.kind = role.kind;
  const bool is_angle = role.kind == AxisKind::longitude || role.kind == AxisKind::latitude;
  if (is_angle && is_radian(variable.units)) out.axis.units = "degrees";
  bool positive_down = role.positive_down;
  if (which == 2) {
    heed_values(variable, coordinates, out.axis.kind, positive_down, out.axis.units, out.note);
  }
  if (which == 2 && !role.kind_is_sure && horizontal == AxisKind::longitude) {
    out.axis.kind = is_length(lower(variable.units)) ? AxisKind::height : AxisKind::level;
  }
  for (const double value : coordinates) {
    if (!std::isfinite(value)) return bad_axis(variable.name, "has missing values");
  }
  if (role.kind == AxisKind::longitude) continue_over_seam(coordinates);
  if (out.note.empty()) out.note = note_on_radians(variable, role.kind, coordinates);
  const bool rises = coordinates.size() < 2 || coordinates[1] > coordinates[0];
  for (std::size_t i = 1; i < coordinates.size(); ++i) {
    const double step = coordinates[i] - coordinates[i - 1];
    if (rises ? !(step > 0) : !(step < 0)) {
      return bad_axis(variable.name,
                      "is not strictly monotonic: " + number_text(coordinates[i - 1]) +
                          " is followed by " + number_text(coordinates[i]));
    }
  }
  const bool shall_rise = !(which == 2 && positive_down);
  if (coordinates.size() > 1 && rises != shall_rise) {
    std::reverse(coordinates.begin(), coordinates.end());
    out.turned = true;
  }
  out.axis.coordinates = std::move(coordinates);
  return out;
}

}  // namespace windsplat::data::cf
