// Finds derivable fields by standard names, units and common names; computes them a few levels at a
// time.
#include "server/data/cf/fields/derived.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/fields/atmosphere.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

constexpr double zero_celsius = 273.15;
constexpr double warmest_celsius = 100;  // larger values are taken as kelvin
constexpr std::size_t values_at_a_time = std::size_t{1} << 20;

bool is_kelvin(std::string_view units) {
  constexpr auto known =
      std::to_array<std::string_view>({"k", "degk", "deg_k", "kelvin", "degrees_k", "kelvins"});
  return is_one_of(units, known);
}

bool is_celsius(std::string_view units) {
  constexpr auto known = std::to_array<std::string_view>(
      {"c", "degc", "deg_c", "celsius", "deg c", "degrees_celsius", "degree_celsius", "degrees_c"});
  return is_one_of(units, known);
}

// Pressure of samples at a step, in Pa.
class Pressures {
 public:
  Pressures(const PressureLevels& levels, const Placement& grid)
      : levels_(levels), layer_(grid.layer()) {}

  Result<void> load(const ArrayFile& file, const Placement& grid, std::size_t step) {
    if (!levels_.hybrid) return {};
    surface_.resize(layer_);
    return read_variable(file, grid, levels_.hybrid->surface, step, {0, grid.length[2]},
                         surface_.data(), [](double) {});
  }
  [[nodiscard]] double at(std::size_t level, std::size_t column) const {
    if (!levels_.hybrid) return levels_.level[level];
    const HybridLevels& hybrid = *levels_.hybrid;
    return hybrid.a[level] +
           hybrid.b[level] * hybrid.unit_pa * static_cast<double>(surface_[column]);
  }

 private:
  const PressureLevels& levels_;
  std::size_t layer_;
  std::vector<float> surface_;
};

class DerivedFinder {
 public:
  DerivedFinder(const ArrayFile& file, const Placement& grid, const std::vector<FieldPlan>& plans,
                const std::vector<int>& variables, const PressureLevels& pressures,
                const LevelHeights& heights, std::vector<std::string>& notes)
      : file_(file),
        grid_(grid),
        plans_(plans),
        variables_(variables),
        pressures_(pressures),
        heights_(heights),
        notes_(notes) {}

  Result<std::vector<DerivedField>> find() {
    const bool has_pressure = pressures_.hybrid || !pressures_.level.empty();
    if (pressures_.hybrid) {
      DerivedField& field =
          add_scalar("pressure", DerivedField::Rule::pressure, pressures_.hybrid->units);
      field.info.standard_name = "air_pressure";
      field.info.long_name = "pressure of the hybrid levels";
    }
    add_height();
    if (has_pressure && grid_.space[2] >= 0) {
      DerivedField& field = add_scalar("standard_height", DerivedField::Rule::standard_height, "m");
      field.info.long_name = "height of the pressure in the ICAO standard atmosphere";
    }
    if (has_pressure) {
      for (const FieldPlan& plan : plans_) {
        if (auto done = add_rise(plan); !done) return done.error();
      }
    }
    return std::move(found_);
  }

 private:
  [[nodiscard]] const FileVariable& variable(int v) const {
    return file_.contents().variables.at(static_cast<std::size_t>(v));
  }

  [[nodiscard]] std::string free_name(std::string name) const {
    const auto taken = [&] {
      return std::any_of(plans_.begin(), plans_.end(),
                         [&](const FieldPlan& plan) { return plan.info.name == name; }) ||
             std::any_of(found_.begin(), found_.end(),
                         [&](const DerivedField& field) { return field.info.name == name; });
    };
    while (taken()) name += "_derived";
    return name;
  }

  DerivedField& add_scalar(const std::string& name, DerivedField::Rule rule,
                           const std::string& units) {
    DerivedField field;
    field.rule = rule;
    field.info.name = free_name(name);
    field.info.components = {field.info.name};
    field.info.units = units;
    field.info.component_units = {units};
    field.info.dtype = "derived";
    field.info.derived = true;
    found_.push_back(std::move(field));
    return found_.back();
  }

  // Metres per unit of a geopotential or geopotential height; 0 for other variables.
  [[nodiscard]] double metres_of(const FileVariable& source) const {
    const std::string units = lower(source.units);
    const std::string name = lower(source.name);
    const std::string long_name = lower(source.long_name);
    constexpr auto energies = std::to_array<std::string_view>(
        {"m2 s-2", "m**2 s**-2", "m^2 s^-2", "m2/s2", "m^2/s^2", "m2.s-2", "j kg-1", "j/kg"});
    if (is_one_of(units, energies)) {
      const bool named = source.standard_name == "geopotential" || long_name == "geopotential" ||
                         name == "z" || name == "phi" || name == "geopotential";
      return named ? 1 / standard_gravity : 0;
    }
    if (source.standard_name != "geopotential_height" &&
        long_name.find("geopotential height") == std::string::npos) {
      return 0;
    }
    if (units == "geopotential meters" || units == "geopotential metres" ||
        units == "geopotential meter" || units == "geopotential metre") {
      return 1;
    }
    return metres_in(units).value_or(0);
  }

  void add_height() {
    if (grid_.space[2] < 0) return;
    if (heights_.parametric) {
      DerivedField& field = add_scalar("height", DerivedField::Rule::level_height, "m");
      field.info.standard_name = "altitude";
      field.info.long_name = "height of the levels";
      return;
    }
    for (const int v : variables_) {
      const double scale = metres_of(variable(v));
      if (scale == 0) continue;
      if (scale == 1 && variable(v).name == "height") return;  // the file has it
      DerivedField& field = add_scalar("height", DerivedField::Rule::height, "m");
      field.info.standard_name = "geopotential_height";
      field.info.long_name = "height above sea level, from " + variable(v).name;
      field.inputs = {v};
      field.scale = scale;
      return;
    }
  }

  // Pa/s per unit of a component; 0 if the unit is not a rate of pressure.
  [[nodiscard]] double omega_unit(const FileVariable& source) const {
    if (const auto unit = pascals_per_second_in(source.units)) return *unit;
    const bool named = source.standard_name == omega_name;
    return named && source.units.empty() ? 1 : 0;
  }

  [[nodiscard]] int temperature_beside(int like) const {
    constexpr auto usual = std::to_array<std::string_view>(
        {"t", "ta", "temp", "tmp", "temperature", "air_temperature", "air"});
    int best = -1;
    for (const int v : variables_) {
      const FileVariable& source = variable(v);
      const auto& same = variable(like).dims;
      const std::string units = lower(source.units);
      if (source.level != variable(like).level ||
          !std::is_permutation(source.dims.begin(), source.dims.end(), same.begin(), same.end()) ||
          !(is_kelvin(units) || is_celsius(units))) {
        continue;
      }
      if (source.standard_name == "air_temperature") return v;
      if (best < 0 && source.standard_name.empty() && is_one_of(lower(source.name), usual))
        best = v;
    }
    return best;
  }

  // Charges the lowest level of a temperature in degrees Celsius, which celsius_of() examines.
  // Errors: bad_data beyond the limit on decoded bytes for opening a dataset.
  Result<void> charge_lowest_level(int temperature) {
    if (is_kelvin(lower(variable(temperature).units))) return {};
    return file_.charge(temperature, decoded_step_bytes(file_, grid_, temperature, {0, 1}));
  }

  // The offset of a temperature to kelvin; requires charge_lowest_level().
  Result<double> celsius_of(int temperature) {
    const FileVariable& source = variable(temperature);
    if (is_kelvin(lower(source.units))) return 0.0;
    std::vector<float> values(grid_.layer());
    if (auto read =
            read_variable(file_, grid_, temperature, 0, {0, 1}, values.data(), [](double) {});
        !read) {
      return read.error();
    }
    float warmest = -1;
    for (const float value : values) warmest = value > warmest ? value : warmest;
    if (static_cast<double>(warmest) <= warmest_celsius) return zero_celsius;
    notes_.push_back(in_quotes(source.name) + " has units " + in_quotes(source.units) +
                     " but values in kelvin: used as kelvin for vertical velocity");
    return 0.0;
  }

  Result<void> add_rise(const FieldPlan& plan) {
    if (plan.variables.size() < 3) return {};
    const int omega = plan.variables[2];
    const double unit = omega_unit(variable(omega));
    if (unit == 0 || plan.info.off_level) return {};
    DerivedField field;
    field.rule = DerivedField::Rule::rise;
    field.inputs = plan.variables;
    field.factors = plan.factors;
    field.scale = unit;
    field.temperature = temperature_beside(omega);
    std::string note = "the vertical part of ";
    std::string from = "the ICAO standard atmosphere's temperature";
    if (field.temperature >= 0) {
      if (auto fine = charge_lowest_level(field.temperature); !fine) {
        notes_.push_back("the vertical part of " + in_quotes(plan.info.name) +
                         " is not converted to metres per second: " + fine.error().message);
        return {};
      }
      auto celsius = celsius_of(field.temperature);
      if (!celsius) return celsius.error();
      field.celsius = *celsius;
      from = "the temperature " + in_quotes(variable(field.temperature).name);
    }
    field.info = plan.info;
    field.info.name = free_name(plan.info.name + "_m");
    field.info.derived = true;
    field.info.components[2] = "w(" + variable(omega).name + ")";
    field.info.component_units[2] = "m s-1";
    field.info.long_name = plan.info.long_name + " in metres per second";
    note += in_quotes(field.info.name) + " is -omega R T / (p g) of " +
            in_quotes(variable(omega).name) + " and " + from;
    notes_.push_back(std::move(note));
    notes_.push_back(
        "the vertical part of " + in_quotes(plan.info.name) + " is in " +
        in_quotes(plan.info.component_units[2]) + ": its lines point up where air rises, but " +
        "its magnitude mixes units; that of " + in_quotes(field.info.name) + " does not");
    found_.push_back(std::move(field));
    return {};
  }

  const ArrayFile& file_;
  const Placement& grid_;
  const std::vector<FieldPlan>& plans_;
  const std::vector<int>& variables_;
  const PressureLevels& pressures_;
  const LevelHeights& heights_;
  std::vector<std::string>& notes_;
  std::vector<DerivedField> found_;
};

// Reads u, v and omega, then converts omega to w in place, a few levels at a time.
Result<void> fill_rise(const ArrayFile& file, const Placement& grid, const Pressures& pressures,
                       const DerivedField& field, std::size_t step, float* out,
                       const Progress& tell) {
  const std::size_t layer = grid.layer();
  const std::size_t samples = layer * grid.length[2];
  for (std::size_t c = 0; c < 3; ++c) {
    const auto part = [&](double done) { tell((static_cast<double>(c) + done) / 4); };
    if (auto done = read_variable(file, grid, field.inputs[c], step, {0, grid.length[2]},
                                  out + c * samples, part);
        !done) {
      return done;
    }
    if (c < 2) multiply(field.factors[c], samples, out + c * samples);
  }
  float* vertical = out + 2 * samples;
  const std::size_t levels = std::max<std::size_t>(1, values_at_a_time / layer);
  std::vector<float> temperature;
  for (std::size_t first = 0; first < grid.length[2]; first += levels) {
    const std::size_t count = std::min(levels, grid.length[2] - first);
    if (field.temperature >= 0) {
      temperature.assign(count * layer, 0.0F);
      if (auto done = read_variable(file, grid, field.temperature, step, {first, count},
                                    temperature.data(), [](double) {});
          !done) {
        return done;
      }
    }
    for (std::size_t n = 0; n < count * layer; ++n) {
      const double pressure = pressures.at(first + n / layer, n % layer);
      const double kelvin = temperature.empty()
                                ? standard_temperature(pressure)
                                : static_cast<double>(temperature[n]) + field.celsius;
      float& w = vertical[first * layer + n];
      w = static_cast<float>(-static_cast<double>(w) * field.scale * dry_air_constant * kelvin /
                             (pressure * standard_gravity));
    }
    tell(0.75 + 0.25 * static_cast<double>(first + count) / static_cast<double>(grid.length[2]));
  }
  return {};
}

}  // namespace

Result<std::vector<DerivedField>> find_derived(const ArrayFile& file, const Placement& grid,
                                               const std::vector<FieldPlan>& plans,
                                               const std::vector<int>& variables,
                                               const PressureLevels& pressures,
                                               const LevelHeights& heights,
                                               std::vector<std::string>& notes) {
  return DerivedFinder(file, grid, plans, variables, pressures, heights, notes).find();
}

Result<void> fill_derived(const ArrayFile& file, const Placement& grid,
                          const PressureLevels& pressures, const LevelHeights& heights,
                          const DerivedField& field, std::size_t step, float* out,
                          const Progress& tell) {
  const std::size_t layer = grid.layer();
  const std::size_t samples = layer * grid.length[2];
  if (field.rule == DerivedField::Rule::height) {
    auto done = read_variable(file, grid, field.inputs[0], step, {0, grid.length[2]}, out, tell);
    for (std::size_t n = 0; done && n < samples; ++n) {
      out[n] = static_cast<float>(static_cast<double>(out[n]) * field.scale);
    }
    return done;
  }
  if (field.rule == DerivedField::Rule::level_height) {
    ParametricHeights at_levels(*heights.parametric);
    if (auto done = at_levels.load(file, grid, step); !done) return done;
    for (std::size_t n = 0; n < samples; ++n) {
      out[n] = static_cast<float>(at_levels.at(n / layer, n % layer));
    }
    tell(1);
    return {};
  }
  Pressures at_samples(pressures, grid);
  if (auto done = at_samples.load(file, grid, step); !done) return done;
  if (field.rule == DerivedField::Rule::rise) {
    return fill_rise(file, grid, at_samples, field, step, out, tell);
  }
  const bool height = field.rule == DerivedField::Rule::standard_height;
  const double unit = pressures.hybrid ? pressures.hybrid->unit_pa : 1;
  for (std::size_t n = 0; n < samples; ++n) {
    const double pressure = at_samples.at(n / layer, n % layer);
    out[n] = static_cast<float>(height ? standard_height(pressure) : pressure / unit);
  }
  tell(1);
  return {};
}

}  // namespace windsplat::data::cf
