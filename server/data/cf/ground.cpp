// Variables -> the one that is the ground -> metres above sea level, land and water told apart.
#include "server/data/cf/ground.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/cf/grid/vertical.hpp"
#include "server/data/cf/time.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

constexpr double gravity_of_surface = 9.80665;  // m s-2, as for geopotentials of levels
// Above the highest mountain known, Olympus Mons at 22 km: a fill value or another unit.
constexpr float height_max = 30'000;  // metres

enum class GroundQuantity { none, altitude, geopotential, depth };

// FoundBy what a variable is recognised, the most certain first.
enum class FoundBy { standard_name, formula, usual_name };

struct GroundCandidate {
  int variable = -1;
  GroundQuantity quantity = GroundQuantity::none;
  FoundBy by = FoundBy::usual_name;
};

GroundQuantity of_standard_name(const std::string& name) {
  if (name == "surface_altitude") return GroundQuantity::altitude;
  if (name == "surface_geopotential") return GroundQuantity::geopotential;
  if (name.starts_with("sea_floor_depth") || name.starts_with("model_sea_floor_depth")) {
    return GroundQuantity::depth;
  }
  return GroundQuantity::none;
}

bool says_any(const std::string& text, std::initializer_list<std::string_view> parts) {
  return std::any_of(parts.begin(), parts.end(),
                     [&](std::string_view part) { return text.find(part) != std::string::npos; });
}

// NCEP's HGT and others are also the heights of surfaces of constant pressure.
bool is_of_pressure_level(const std::string& long_name) {
  return says_any(long_name, {"hpa", " mb", "millibar", "pressure", "isobaric", "tropopause"}) ||
         (says_any(long_name, {"geopotential"}) &&
          !says_any(long_name, {"surface", "ground", "terrain", "orograph"}));
}

// A depth that names the floor, and no layer in the water or on land.
bool is_depth_of_floor(const std::string& long_name) {
  return says_any(long_name, {"sea floor", "bathymetry", "bottom", "ocean"}) &&
         !says_any(long_name, {"mixed", "layer", "cline", "isotherm", "snow", "ice", "light"});
}

// Names of models: WRF, CMIP, COSMO, ICON, the Unified Model, FV3; ROMS, NEMO, MOM6, MITgcm. A
// short one needs a long name that says the same.
GroundQuantity of_usual_name(const FileVariable& variable) {
  constexpr auto heights = std::to_array<std::string_view>(
      {"hgt", "hgt_m", "orog", "orography", "hsurf", "topography_c", "zsurf", "hgtsfc"});
  constexpr auto geopotentials = std::to_array<std::string_view>({"phis", "fis", "geosp"});
  constexpr auto depths = std::to_array<std::string_view>(
      {"deptho", "depth_ocean", "bathymetry", "bathy", "bathy_meter", "bathy_metry"});
  const std::string name = lower(variable.name);
  const std::string long_name = lower(variable.long_name);
  const bool of_level = is_of_pressure_level(long_name);
  if (!variable.standard_name.empty()) {
    const bool surface = says_any(long_name, {"surface", "orography"}) && !of_level;
    const bool of_surface = variable.standard_name == "geopotential" && surface;
    return of_surface ? GroundQuantity::geopotential : GroundQuantity::none;
  }
  if (is_one_of(name, heights)) return of_level ? GroundQuantity::none : GroundQuantity::altitude;
  if (is_one_of(name, geopotentials)) return GroundQuantity::geopotential;
  const bool short_depth = (name == "h" && says_any(long_name, {"bathymetry"})) ||
                           (name == "depth" && is_depth_of_floor(long_name));
  if (is_one_of(name, depths) || short_depth) return GroundQuantity::depth;
  return GroundQuantity::none;
}

// Metres upward per unit of the variable; empty if the unit does not fit.
std::optional<double> upward_metres(const FileVariable& variable, const GroundCandidate& as) {
  if (as.quantity == GroundQuantity::geopotential) {
    const auto energy = unit_ratio(variable.units, "m2 s-2");
    if (!energy || variable.units.empty()) return std::nullopt;
    return *energy / gravity_of_surface;
  }
  // Terms of a formula are in metres if they do not say otherwise.
  const bool bare = variable.units.empty() && as.by == FoundBy::formula;
  const auto metres = bare ? std::optional(1.0) : metres_in(variable.units);
  if (!metres) return std::nullopt;
  const bool downward = as.quantity == GroundQuantity::depth && lower(variable.positive) != "up";
  return downward ? -*metres : *metres;
}

// Depths that are heights throughout, or reach farther up than down: elevations are also called
// bathymetry. Those of a standard name or a formula are defined as downward.
std::string fault_of_depths(const std::vector<float>& depths, bool may_be_elevations) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const float depth : depths) {
    if (!std::isfinite(depth)) continue;
    low = std::min(low, static_cast<double>(depth));
    high = std::max(high, static_cast<double>(depth));
  }
  if (low <= high && high < 0) return "its depths are below zero throughout";
  if (!may_be_elevations || !(low < -high)) return {};
  return "its depths of " + number_text(low) + " .. " + number_text(high) +
         " reach farther above zero than below, as elevations do; its attribute 'positive' ('up' "
         "or "
         "'down') would tell";
}

class GroundFinder {
 public:
  GroundFinder(const ArrayFile& file, const LevelHeights& heights, const Placement& grid,
               DatasetInfo& info)
      : file_(file), heights_(heights), grid_(grid), info_(info) {}

  void find() {
    std::vector<GroundCandidate> all = candidates();
    std::stable_sort(
        all.begin(), all.end(),
        [](const GroundCandidate& a, const GroundCandidate& b) { return a.by < b.by; });
    for (const GroundCandidate& one : all) {
      std::string fault = use(one);
      if (fault.empty()) return;
      info_.notes.push_back(in_quotes(variable(one.variable).name) +
                            " is not drawn as the ground: " + fault);
    }
  }

 private:
  [[nodiscard]] const FileVariable& variable(int v) const {
    return file_.contents().variables.at(at(v));
  }

  // The surface of a hybrid height or the depth of an ocean, as the formula of the levels has it.
  // The first of two parts of a surface (SLEVE) is neither.
  [[nodiscard]] GroundQuantity of_formula(int v) const {
    if (!heights_.parametric || heights_.parametric->columns[0] != v) return GroundQuantity::none;
    const std::string_view term = heights_.parametric->first_term;
    if (term == "orog") return GroundQuantity::altitude;
    return term == "depth" ? GroundQuantity::depth : GroundQuantity::none;
  }

  [[nodiscard]] std::vector<GroundCandidate> candidates() {
    std::vector<GroundCandidate> out;
    const FileContents& contents = file_.contents();
    for (std::size_t v = 0; v < contents.variables.size(); ++v) {
      const FileVariable& one = contents.variables[v];
      const int self = static_cast<int>(v);
      // Not of a chosen level, and no statistic such as a standard deviation.
      const bool plain = one.process.empty() || one.process == one.name;
      if (!one.numeric || !one.level.empty() || !plain || is_statistic(self)) continue;
      GroundCandidate found{self, of_standard_name(one.standard_name), FoundBy::standard_name};
      if (found.quantity == GroundQuantity::none) {
        found = {self, of_formula(self), FoundBy::formula};
      }
      if (found.quantity == GroundQuantity::none) {
        found = {self, of_usual_name(one), FoundBy::usual_name};
      }
      if (found.quantity == GroundQuantity::none) continue;
      if (on_columns(contents, grid_, self)) {
        out.push_back(found);
      } else if (found.by == FoundBy::standard_name) {
        tell_elsewhere(one);
      }
    }
    return out;
  }

  [[nodiscard]] bool is_statistic(int v) const {
    const std::string methods = file_.text_of(v, "cell_methods");
    const auto says = [&](const char* part) { return methods.find(part) != std::string::npos; };
    return says("deviation") || says("variance") || says("maximum") || says("minimum") ||
           says("range");
  }

  // At the edges or corners of cells, or on the points of another grid.
  void tell_elsewhere(const FileVariable& one) {
    const auto& dimensions = file_.contents().dimensions;
    const auto long_ones = std::count_if(one.dims.begin(), one.dims.end(), [&](int d) {
      return d != grid_.time && dimensions[at(d)].length > 1;
    });
    if (long_ones != 2) return;
    info_.notes.push_back(in_quotes(one.name) +
                          " is not drawn as the ground: it is on other points than the fields");
  }

  // Sets the ground, or returns why not.
  std::string use(const GroundCandidate& from) {
    const FileVariable& one = variable(from.variable);
    const auto factor = upward_metres(one, from);
    if (!factor) {
      const std::string unit = one.units.empty() ? "without a unit" : "in " + in_quotes(one.units);
      return "it is " + unit + ", which is no unit of " +
             (from.quantity == GroundQuantity::geopotential ? "a geopotential" : "length");
    }
    std::vector<float> values;
    if (std::string fault = read(from.variable, values); !fault.empty()) return fault;
    if (from.quantity == GroundQuantity::depth && lower(one.positive) != "up") {
      const bool is_defined = from.by != FoundBy::usual_name || !one.positive.empty();
      if (std::string fault = fault_of_depths(values, !is_defined); !fault.empty()) return fault;
    }
    if (from.quantity != GroundQuantity::depth && lower(one.positive) == "down") {
      return "its attribute 'positive' is 'down'";
    }
    multiply(*factor, values.size(), values.data());
    // A depth of 0 is a height of 0, not of -0.
    for (float& value : values) {
      value = std::isfinite(value) ? value + 0.0F : std::numeric_limits<float>::quiet_NaN();
    }
    const auto too_far = std::find_if(values.begin(), values.end(),
                                      [](float z) { return std::abs(z) > height_max; });
    if (too_far != values.end()) {
      return "its values reach " + number_text(static_cast<double>(*too_far)) +
             " m, where mountains and seas end at " + number_text(static_cast<double>(height_max));
    }
    const bool sea_floor = from.quantity == GroundQuantity::depth;
    if (sea_floor) raise_land(values);
    if (std::all_of(values.begin(), values.end(), [](float z) { return std::isnan(z); })) {
      return "it is masked throughout";
    }
    Ground ground;
    ground.name = one.name;
    ground.kind = sea_floor ? GroundKind::sea_floor : GroundKind::land;
    ground.heights = std::move(values);
    info_.grid.ground = std::make_shared<const Ground>(std::move(ground));
    for (LeftOut& left : info_.left_out) {
      if (left.name == one.name) left.reason = "gives the height of the ground (view.ground)";
    }
    return {};
  }

  std::string read_at(int v, std::size_t step, std::vector<float>& values) const {
    values.assign(grid_.layer(), 0.0F);
    auto done =
        read_variable(file_, grid_, v, step, {0, grid_.length[2]}, values.data(), [](double) {});
    return done ? "" : done.error().message;
  }

  std::string read(int v, std::vector<float>& values) const {
    const double bytes = decoded_step_bytes(file_, grid_, v, {0, 1});
    const auto& dims = variable(v).dims;
    const bool moves = grid_.time >= 0 && info_.steps.size() > 1 &&
                       std::find(dims.begin(), dims.end(), grid_.time) != dims.end();
    if (auto fine = file_.charge(v, moves ? 3 * bytes : bytes); !fine) return fine.error().message;
    std::string fault = read_at(v, 0, values);
    if (!fault.empty() || !moves) return fault;
    for (const std::size_t step : {std::size_t{1}, info_.steps.size() - 1}) {
      std::vector<float> later;
      fault = read_at(v, step, later);
      if (!fault.empty()) return fault;
      const bool same =
          std::equal(values.begin(), values.end(), later.begin(),
                     [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); });
      if (!same) return "it changes with time";
    }
    return {};
  }

  // Land of an ocean reaches up to the surface, whatever depth the model stores there.
  void raise_land(std::vector<float>& heights) const {
    const FileContents& contents = file_.contents();
    for (std::size_t v = 0; v < contents.variables.size(); ++v) {
      const FileVariable& one = contents.variables[v];
      const bool by_land = one.standard_name == "land_binary_mask";
      const bool by_sea = one.standard_name == "sea_binary_mask" || one.name == "mask_rho" ||
                          (one.name == "wet" && lower(one.long_name).starts_with("0 if land"));
      const int self = static_cast<int>(v);
      if (!(by_land || by_sea) || !on_columns(contents, grid_, self)) continue;
      std::vector<float> mask;
      if (!file_.charge(self, decoded_step_bytes(file_, grid_, self, {0, 1}))) continue;
      if (!read_at(self, 0, mask).empty()) continue;
      for (std::size_t n = 0; n < heights.size(); ++n) {
        if (mask[n] == (by_land ? 1.0F : 0.0F)) heights[n] = std::fmax(heights[n], 0.0F);
      }
      for (LeftOut& left : info_.left_out) {
        if (left.name == one.name) left.reason = "gives the land of the ground (view.ground)";
      }
      return;
    }
  }

  const ArrayFile& file_;
  const LevelHeights& heights_;
  const Placement& grid_;
  DatasetInfo& info_;
};

}  // namespace

void find_ground(const ArrayFile& file, const LevelHeights& heights, const Placement& grid,
                 DatasetInfo& info) {
  if (grid.length[2] < 2) return;
  GroundFinder(file, heights, grid, info).find();
}

}  // namespace windsplat::data::cf
