#include "server/data/cf/staggered/models.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace windsplat::data::cf {

namespace {

// Constants of the model (share/module_model_constants.F).
constexpr double gravity = 9.81;          // m s-2
constexpr double base_potential_k = 300;  // subtracted from T
constexpr double reference_pressure_pa = 1e5;
constexpr double gas_constant_over_heat = 2.0 / 7.0;  // R / cp of dry air

double wrf_pressure(const double* in) { return in[0] + in[1]; }
double wrf_height(const double* in) { return (in[0] + in[1]) / gravity; }
double wrf_temperature(const double* in) {
  return (in[0] + base_potential_k) *
         std::pow((in[1] + in[2]) / reference_pressure_pa, gas_constant_over_heat);
}

struct WrfFormula {
  const char* name;
  const char* standard_name;
  const char* long_name;
  const char* units;
  std::array<const char*, 3> inputs;
  double (*value)(const double* inputs);
};
constexpr auto wrf_formulas = std::to_array<WrfFormula>({
    {"pressure", "air_pressure", "pressure, P + PB", "Pa", {"P", "PB", nullptr}, wrf_pressure},
    {"temperature",
     "air_temperature",
     "temperature, from T + 300 K",
     "K",
     {"T", "P", "PB"},
     wrf_temperature},
    {"height",
     "geopotential_height",
     "height above sea level, (PH + PHB) / g",
     "m",
     {"PH", "PHB", nullptr},
     wrf_height},
});

bool has_dimensions(const FileContents& contents, std::initializer_list<std::string_view> names) {
  return std::all_of(names.begin(), names.end(), [&](std::string_view name) {
    return std::any_of(contents.dimensions.begin(), contents.dimensions.end(),
                       [&](const FileDimension& d) { return d.name == name; });
  });
}

bool is_wrf(const FileContents& contents) {
  return has_dimensions(contents, {"west_east", "south_north", "bottom_top"});
}

bool is_roms(const FileContents& contents) {
  return has_dimensions(contents, {"xi_rho", "eta_rho", "s_rho"});
}

using Names = std::array<std::pair<std::string_view, const char*>, 3>;
constexpr Names wrf_names{{{"U", "x_wind"}, {"V", "y_wind"}, {"W", "upward_air_velocity"}}};
constexpr Names roms_names{{{"u", "sea_water_x_velocity"},
                            {"v", "sea_water_y_velocity"},
                            {"w", "upward_sea_water_velocity"}}};

// NEMO's names, which no other model uses.
constexpr Names nemo_names{{{"vozocrtx", "sea_water_x_velocity"},
                            {"vomecrty", "sea_water_y_velocity"},
                            {"vovecrtz", "upward_sea_water_velocity"}}};

void name_by(FileContents& contents, const Names& names) {
  for (FileVariable& variable : contents.variables) {
    for (const auto& [name, standard_name] : names) {
      if (variable.name == name && variable.standard_name.empty()) {
        variable.standard_name = standard_name;
      }
    }
  }
}

}  // namespace

std::vector<ComputedVariable> variables_of_wrf(const FileContents& contents) {
  std::vector<ComputedVariable> out;
  if (!is_wrf(contents)) return out;
  for (const WrfFormula& formula : wrf_formulas) {
    ComputedVariable computed;
    for (const char* input : formula.inputs) {
      if (input != nullptr) computed.inputs.push_back(variable_named(contents, input));
    }
    const auto usable = [&](int v) {
      return v >= 0 && contents.variables[at(v)].numeric &&
             contents.variables[at(v)].dims == contents.variables[at(computed.inputs[0])].dims;
    };
    if (!std::all_of(computed.inputs.begin(), computed.inputs.end(), usable) ||
        variable_named(contents, formula.name) >= 0) {
      continue;
    }
    FileVariable& variable = computed.variable;
    variable.name = formula.name;
    variable.type = "float32";
    variable.numeric = true;
    variable.dims = contents.variables[at(computed.inputs[0])].dims;
    variable.standard_name = formula.standard_name;
    variable.long_name = formula.long_name;
    variable.units = formula.units;
    variable.layers_apart = contents.variables[at(computed.inputs[0])].layers_apart;
    computed.value = formula.value;
    out.push_back(std::move(computed));
  }
  return out;
}

void name_velocities(FileContents& contents) {
  if (is_wrf(contents)) name_by(contents, wrf_names);
  if (is_roms(contents)) name_by(contents, roms_names);
  name_by(contents, nemo_names);
}

}  // namespace windsplat::data::cf
