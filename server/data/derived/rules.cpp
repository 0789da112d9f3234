// Recognises velocities by their units, air by standard names, units and common names.
#include "server/data/derived/rules.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/units.hpp"
#include "server/data/derived/lengths.hpp"

namespace windsplat::data::derived {

namespace {

constexpr std::size_t vectors_max = 4;

// Metres per second; nullopt: not a velocity.
std::optional<double> velocity_unit(const std::string& text) {
  constexpr auto knots = std::to_array<std::string_view>({"knot", "knots", "kt", "kts"});
  struct Ending {
    std::string_view text;
    double seconds;
  };
  constexpr auto endings = std::to_array<Ending>({{"/s", 1},
                                                  {" s-1", 1},
                                                  {" s^-1", 1},
                                                  {" s**-1", 1},
                                                  {"*s-1", 1},
                                                  {".s-1", 1},
                                                  {"/sec", 1},
                                                  {"/second", 1},
                                                  {" second-1", 1},
                                                  {"/h", 3600},
                                                  {"/hr", 3600},
                                                  {" h-1", 3600},
                                                  {" hr-1", 3600}});
  const std::string unit = lower(text);
  if (is_one_of(unit, knots)) return 1852.0 / 3600;
  if (unit == "ms-1") return 1;
  for (const Ending& ending : endings) {
    if (!unit.ends_with(ending.text)) continue;
    const auto metres =
        metres_in(std::string_view(unit).substr(0, unit.size() - ending.text.size()));
    if (metres) return *metres / ending.seconds;
  }
  return std::nullopt;
}

// "V m-1" -> "V m-2".
std::string per_metre(const std::string& units) {
  constexpr std::string_view last = " m-1";
  if (units.ends_with(last)) return units.substr(0, units.size() - last.size()) + " m-2";
  return units == "1" ? "m-1" : units + " m-1";
}

std::optional<Input> kelvin(const FieldInfo& field, std::size_t index) {
  constexpr auto kelvins =
      std::to_array<std::string_view>({"k", "degk", "deg_k", "kelvin", "kelvins", "degrees_k"});
  constexpr auto celsius = std::to_array<std::string_view>(
      {"c", "degc", "deg_c", "celsius", "deg c", "degrees_celsius", "degree_celsius", "degrees_c"});
  const std::string units = lower(field.units);
  if (is_one_of(units, kelvins)) return Input{index, 1, 0};
  if (is_one_of(units, celsius)) return Input{index, 1, 273.15};
  return std::nullopt;
}

std::optional<Input> mass_fraction(const FieldInfo& field, std::size_t index) {
  constexpr auto ones = std::to_array<std::string_view>(
      {"1", "kg/kg", "kg kg-1", "kg kg**-1", "kg kg^-1", "g/g", "g g-1"});
  constexpr auto thousandths =
      std::to_array<std::string_view>({"g/kg", "g kg-1", "g kg**-1", "g kg^-1"});
  const std::string units = lower(field.units);
  if (is_one_of(units, ones)) return Input{index, 1, 0};
  if (is_one_of(units, thousandths)) return Input{index, 0.001, 0};
  return std::nullopt;
}

std::optional<Input> pascals(const FieldInfo& field, std::size_t index) {
  const auto unit = pascals_in(field.units);
  return unit ? std::optional(Input{index, *unit, 0}) : std::nullopt;
}

std::optional<Input> metres(const FieldInfo& field, std::size_t index) {
  const auto unit = metres_in(field.units);
  return unit ? std::optional(Input{index, *unit, 0}) : std::nullopt;
}

using Reading = std::optional<Input> (*)(const FieldInfo& field, std::size_t index);

class Finder {
 public:
  explicit Finder(const DatasetInfo& info)
      : info_(info),
        has_surface_(surface_of(info.grid) != Surface::unknown),
        heights_(find_heights()),
        has_heights_(has_surface_ && (heights_ || level_heights(info.grid))) {}

  std::vector<Rule> find() {
    std::vector<std::size_t> vectors;
    for (std::size_t f = 0; f < info_.fields.size(); ++f) {
      if (info_.fields[f].kind == FieldKind::vector) vectors.push_back(f);
    }
    vectors.resize(std::min(vectors.size(), vectors_max));
    for (const std::size_t f : vectors) {
      const FieldInfo& field = info_.fields[f];
      const bool repeats = std::any_of(vectors.begin(), vectors.end(), [&](std::size_t other) {
        const auto& components = info_.fields[other].components;
        return other < f &&
               std::equal(components.begin(), components.begin() + 2, field.components.begin());
      });
      add_vector(f, repeats);
    }
    add_air();
    return std::move(rules_);
  }

 private:
  // The best of the scalars at the grid's place: by standard name, otherwise one without that has a
  // common name.
  template <std::size_t count>
  [[nodiscard]] std::optional<Input> scalar(std::string_view standard_name,
                                            const std::array<std::string_view, count>& usual,
                                            Reading reading) const {
    std::optional<Input> best;
    for (std::size_t f = 0; f < info_.fields.size(); ++f) {
      const FieldInfo& field = info_.fields[f];
      if (field.kind != FieldKind::scalar || field.off_level) continue;
      const auto input = reading(field, f);
      if (!input) continue;
      if (field.standard_name == standard_name) return input;
      const bool is_usual = field.standard_name.empty() && is_one_of(lower(field.name), usual);
      if (!best && is_usual) best = input;
    }
    return best;
  }

  // Heights of the samples, where the vertical axis does not state those of all columns.
  [[nodiscard]] std::optional<Input> find_heights() const {
    const Axis& z = info_.grid.axes[2];
    if (z.coordinates.size() < 2) return std::nullopt;
    // Levels at their mean heights, which vary along them.
    const FieldInfo* own = info_.find("height");
    if (own != nullptr && own->derived && own->kind == FieldKind::scalar) {
      const auto found = metres(*own, static_cast<std::size_t>(own - info_.fields.data()));
      if (found) return found;
    }
    if (metres_in(z.units)) return std::nullopt;
    constexpr auto usual = std::to_array<std::string_view>({"height"});
    if (const auto found = scalar("geopotential_height", usual, metres)) return found;
    // Levels whose pressure varies along them.
    const FieldInfo* pressure = info_.find("pressure");
    if (pressure == nullptr || !pressure->derived) return std::nullopt;
    constexpr auto standard = std::to_array<std::string_view>({"standard_height"});
    return scalar("altitude", standard, metres);
  }

  void add(Rule rule, const std::string& name, const std::string& units,
           const std::string& long_name, std::vector<std::string> components = {}) {
    if (info_.find(name) != nullptr) return;
    rule.info.name = name;
    rule.info.kind = components.empty() ? FieldKind::scalar : FieldKind::vector;
    if (components.empty()) components = {name};
    rule.info.component_units.assign(components.size(), units);
    rule.info.components = std::move(components);
    rule.info.units = units;
    rule.info.long_name = long_name;
    rule.info.dtype = "derived";
    rule.info.derived = true;
    charge(rule);
    rules_.push_back(std::move(rule));
  }

  // What reading the inputs decodes and holds.
  void charge(Rule& rule) const {
    const bool of_air = rule.temperature || rule.potential;
    std::uint64_t held = 0;
    const auto take = [&](std::size_t index) {
      const FieldInfo& field = info_.fields[index];
      const std::uint64_t volume = info_.grid.samples() * field.components.size() * sizeof(float);
      rule.info.decoded_bytes += std::max(field.decoded_bytes, volume);
      rule.info.chunk_bytes = std::max(rule.info.chunk_bytes, field.chunk_bytes);
      held += volume;
    };
    if (!of_air) take(rule.vector);
    for (const auto& input :
         {rule.heights, rule.temperature, rule.potential, rule.pressure, rule.humidity}) {
      if (input) take(input->field);
    }
    rule.info.chunk_bytes = std::max(rule.info.chunk_bytes, held);
  }

  void add_vector(std::size_t index, bool repeats) {
    const FieldInfo& field = info_.fields[index];
    Rule rule;
    rule.vector = index;
    bool is_velocity = true;  // horizontally
    bool is_whole = field.components.size() == 3;
    bool same_units = true;
    for (std::size_t c = 0; c < field.components.size(); ++c) {
      const auto unit = velocity_unit(field.component_units[c]);
      rule.factor.at(c) = unit.value_or(1);
      if (!unit && c < 2) is_velocity = false;
      if (!unit) is_whole = false;
      same_units = same_units && field.component_units[c] == field.units;
    }
    if (is_velocity) {
      add_magnitudes(rule, field, is_whole, repeats);
      add_flow(rule, field, is_whole && has_heights_, repeats);
    } else if (same_units) {
      rule.factor = {1, 1, 1};
      add_other(rule, field);
    }
  }

  void add_magnitudes(Rule rule, const FieldInfo& field, bool is_whole, bool repeats) {
    const std::size_t wanted = is_whole ? 3 : 2;
    const auto& units = field.component_units;
    const auto end = units.begin() + static_cast<std::ptrdiff_t>(wanted);
    const bool same = std::all_of(units.begin(), end, [&](auto& u) { return u == field.units; });
    if (same) rule.factor = {1, 1, 1};
    const std::string shown = same ? field.units : "m s-1";
    if (is_whole || field.components.size() == 2) {
      rule.quantity = Quantity::magnitude;
      add(rule, field.name + "_speed", shown, "speed of " + field.name);
    }
    if (repeats || field.components.size() == 2) return;
    rule.quantity = Quantity::horizontal_magnitude;
    add(rule, field.name + "_horizontal_speed", shown, "horizontal speed of " + field.name);
  }

  // Whether the wind is three-dimensional: its third component and heights are known.
  void add_flow(Rule rule, const FieldInfo& field, bool in_space, bool repeats) {
    if (!has_surface_) return;
    const std::string of = " of " + field.name;
    if (in_space) {
      rule.heights = heights_;
      rule.quantity = Quantity::curl;
      add(rule, field.name + "_vorticity", "s-1", "vorticity" + of + ": its curl",
          vorticity_components(field.name + "_vorticity"));
    }
    Rule level = rule;
    level.heights.reset();
    if (!repeats) {
      level.quantity = Quantity::vertical_curl;
      add(level, field.name + "_vertical_vorticity", "s-1",
          "vertical vorticity" + of + ": dv/dx - du/dy along the levels");
    }
    if (!in_space) {
      level.quantity = Quantity::horizontal_divergence;
      if (!repeats) {
        add(level, field.name + "_divergence", "s-1",
            "horizontal divergence" + of + ": du/dx + dv/dy along the levels");
      }
      return;
    }
    rule.quantity = Quantity::divergence;
    add(rule, field.name + "_divergence", "s-1",
        "divergence" + of + " in three dimensions: du/dx + dv/dy + dw/dz");
    rule.quantity = Quantity::q_criterion;
    add(rule, field.name + "_q_criterion", "s-2", "Q criterion" + of + ": positive in vortices");
    rule.quantity = Quantity::helicity;
    add(rule, field.name + "_helicity", "m s-2", "helicity" + of + ": u . curl u");
  }

  static std::vector<std::string> vorticity_components(const std::string& name) {
    return {name + "_x", name + "_y", name + "_z"};
  }

  void add_other(Rule rule, const FieldInfo& field) {
    const std::string of = " of " + field.name;
    rule.quantity = Quantity::magnitude;
    add(rule, field.name + "_magnitude", field.units, "magnitude" + of);
    if (!has_surface_ || field.units.empty()) return;
    const std::string units = per_metre(field.units);
    if (field.components.size() == 2) {
      rule.quantity = Quantity::horizontal_divergence;
      add(rule, field.name + "_divergence", units, "horizontal divergence" + of);
      rule.quantity = Quantity::vertical_curl;
      add(rule, field.name + "_vertical_curl", units, "vertical component of the curl" + of);
    } else if (has_heights_) {
      rule.heights = heights_;
      rule.quantity = Quantity::divergence;
      add(rule, field.name + "_divergence", units, "divergence" + of + " in three dimensions");
      rule.quantity = Quantity::curl;
      add(rule, field.name + "_curl", units, "curl" + of,
          vorticity_components(field.name + "_curl"));
    }
  }

  void add_air() {
    const Axis& z = info_.grid.axes[2];
    if (z.kind == AxisKind::depth) return;
    constexpr std::array<std::string_view, 0> no_names{};
    constexpr auto pressures =
        std::to_array<std::string_view>({"pressure", "p", "pres", "air_pressure"});
    constexpr auto temperatures = std::to_array<std::string_view>(
        {"t", "ta", "temp", "tmp", "temperature", "air_temperature", "air"});
    constexpr auto potentials =
        std::to_array<std::string_view>({"theta", "th", "potential_temperature", "pot_temp"});
    Rule rule;
    const bool by_axis = z.kind == AxisKind::pressure && pascals_in(z.units).has_value();
    rule.pressure = by_axis ? scalar("air_pressure", no_names, pascals)
                            : scalar("air_pressure", pressures, pascals);
    if (!rule.pressure && !by_axis) return;
    rule.temperature = scalar("air_temperature", temperatures, kelvin);
    if (!rule.temperature) {
      rule.potential = scalar("air_potential_temperature", potentials, kelvin);
      if (!rule.potential) return;
      rule.quantity = Quantity::temperature;
      add(rule, "temperature", "K",
          "temperature, from " + info_.fields[rule.potential->field].name +
              ": theta (p / 1000 hPa)^0.2854");
    }
    add_humidity(std::move(rule));
  }

  void add_humidity(Rule rule) {
    constexpr auto relative =
        std::to_array<std::string_view>({"rh", "hur", "r", "relhum", "rhum", "relative_humidity"});
    constexpr auto specific =
        std::to_array<std::string_view>({"q", "hus", "shum", "spfh", "specific_humidity", "huss"});
    constexpr auto mixing =
        std::to_array<std::string_view>({"qv", "qvapor", "mixing_ratio", "humidity_mixing_ratio"});
    const auto any = [](const FieldInfo&, std::size_t index) {
      return std::optional(Input{index});
    };
    if (scalar("relative_humidity", relative, any)) return;
    rule.humidity = scalar("specific_humidity", specific, mass_fraction);
    rule.is_specific = rule.humidity.has_value();
    if (!rule.humidity) rule.humidity = scalar("humidity_mixing_ratio", mixing, mass_fraction);
    if (!rule.humidity) return;
    rule.quantity = Quantity::relative_humidity;
    const std::string source = "relative humidity over water (Bolton 1980), from " +
                               info_.fields[rule.humidity->field].name;
    add(std::move(rule), "relative_humidity", "%", source);
  }

  const DatasetInfo& info_;
  bool has_surface_;
  std::optional<Input> heights_;
  bool has_heights_;
  std::vector<Rule> rules_;
};

}  // namespace

std::vector<Rule> find_rules(const DatasetInfo& info) { return Finder(info).find(); }

}  // namespace windsplat::data::derived
