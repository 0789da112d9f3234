// Recognises the components of a vector in three ways, the most reliable first.
#include "server/data/cf/fields/fields.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

// Whether units are those of a velocity; absent units are accepted.
bool is_velocity(const std::string& units) { return units.empty() || is_speed(units); }

// A unit for notes, cut where it is longer than any usual one.
std::string shown_unit(const std::string& unit) {
  constexpr std::size_t most = 64;
  if (unit.size() <= most) return unit;
  std::size_t end = most;
  while (end > 0 && (static_cast<unsigned char>(unit[end]) & 0xC0U) == 0x80U) --end;
  return unit.substr(0, end) + "...";
}

class FieldFinder {
 public:
  FieldFinder(const FileContents& contents, const std::vector<int>& variables, AxisKind vertical,
              std::vector<std::string>& notes)
      : contents_(contents), variables_(variables), vertical_(vertical), notes_(notes) {}

  std::vector<FieldPlan> find() {
    by_mark();
    by_standard_name();
    for (const int v : variables_) {
      by_suffix(v);
      by_first_letter(v);
    }
    for (const int v : variables_) {
      add_scalar(v);
    }
    return std::move(plans_);
  }

 private:
  [[nodiscard]] const FileVariable& variable(int v) const {
    return contents_.variables.at(static_cast<std::size_t>(v));
  }

  [[nodiscard]] bool is_used(int v) const {
    return std::any_of(plans_.begin(), plans_.end(), [v](const FieldPlan& plan) {
      return std::find(plan.variables.begin(), plan.variables.end(), v) != plan.variables.end();
    });
  }

  // An unused variable on the dimensions of `like`, in any order, whose text is `wanted`; -1 if
  // there is none.
  template <class Text>
  [[nodiscard]] int partner(int like, std::string_view wanted, Text text) const {
    for (const int v : variables_) {
      const auto& dims = variable(v).dims;
      const auto& same = variable(like).dims;
      if (v != like && !is_used(v) && text(variable(v)) == wanted &&
          variable(v).process == variable(like).process &&
          variable(v).level == variable(like).level &&
          std::is_permutation(dims.begin(), dims.end(), same.begin(), same.end())) {
        return v;
      }
    }
    return -1;
  }
  [[nodiscard]] int named(int like, const std::string& name) const {
    return partner(like, name, [](const FileVariable& v) { return lower(v.name); });
  }
  [[nodiscard]] int standing_for(int like, const std::string& standard_name) const {
    return partner(like, standard_name, [](const FileVariable& v) { return v.standard_name; });
  }

  [[nodiscard]] bool is_omega(int v) const {
    return pascals_per_second_in(variable(v).units).has_value() ||
           (variable(v).units.empty() && variable(v).standard_name == omega_name);
  }

  // Whether the unit of component v can be that of the vector of `first`; a note says if not. A
  // third one may also be a rate of pressure beside velocities, or lack a unit.
  [[nodiscard]] bool joins(int first, int v, bool is_third) {
    const std::string& own = variable(v).units;
    const std::string& wanted = variable(first).units;
    if (is_third && (own.empty() || wanted.empty())) return true;
    if (is_third && is_omega(v) && is_velocity(wanted)) return true;
    if (own.empty() == wanted.empty() && unit_ratio(own, wanted)) return true;
    const auto shown = [](const std::string& unit) {
      return unit.empty() ? "no unit" : shown_unit(unit);
    };
    tell(in_quotes(variable(v).name) + " (" + shown(own) + ") is no component of a vector with " +
         in_quotes(variable(first).name) + " (" + shown(wanted) +
         "): its unit cannot be converted to that");
    return false;
  }

  void tell(std::string note) {
    if (std::find(notes_.begin(), notes_.end(), note) == notes_.end()) {
      notes_.push_back(std::move(note));
    }
  }

  // A name different from those of all variables and vectors, since views refer to fields by name.
  [[nodiscard]] std::string free_name(const std::string& wanted) const {
    const auto is_taken = [&](const std::string& name) {
      return std::any_of(variables_.begin(), variables_.end(),
                         [&](int v) { return variable(v).name == name; }) ||
             std::any_of(plans_.begin(), plans_.end(),
                         [&](const FieldPlan& plan) { return plan.info.name == name; });
    };
    if (!is_taken(wanted)) {
      return wanted;
    }
    const std::string base = wanted + "_vector";
    std::string name = base;
    for (int n = 2; is_taken(name); ++n) {
      name = base + '_' + std::to_string(n);
    }
    return name;
  }

  [[nodiscard]] static std::string dtype_of(const FileVariable& variable) {
    return variable.type + (variable.packed ? " packed" : "");
  }

  void add_vector(const std::string& name, std::vector<int> components) {
    FieldPlan plan;
    const FileVariable& first = variable(components.front());
    plan.info.name = free_name(first.process.empty() ? name : name + "_" + first.process);
    plan.info.kind = FieldKind::vector;
    plan.info.units = first.units;
    plan.info.dtype = dtype_of(first);
    const bool with_omega = components.size() > 2 && is_omega(components[2]);
    if (with_omega && unit_ratio(first.units, "m s-1").value_or(1) != 1) plan.info.units = "m s-1";
    for (const int v : components) {
      plan.info.components.push_back(variable(v).name);
      add_unit(plan, v, with_omega && v == components[2]);
      plan.info.long_name +=
          (plan.info.long_name.empty() ? "" : ", ") +
          (variable(v).long_name.empty() ? variable(v).name : variable(v).long_name);
    }
    plan.variables = std::move(components);
    plans_.push_back(std::move(plan));
  }

  // Adds the unit of a component and the factor to it.
  void add_unit(FieldPlan& plan, int v, bool is_rate_of_pressure) {
    const std::string& own = variable(v).units;
    const std::string& wanted = plan.info.units;
    plan.factors.push_back(is_rate_of_pressure ? 1 : unit_ratio(own, wanted).value_or(1));
    if (is_rate_of_pressure) {
      // The unit by convention if the file has none.
      plan.info.component_units.push_back(own.empty() ? "Pa s-1" : own);
      return;
    }
    plan.info.component_units.push_back(own.empty() ? own : wanted);
    const std::string of = " of " + in_quotes(plan.info.name) + ' ';
    if (plan.factors.back() != 1) {
      tell("the component " + in_quotes(variable(v).name) + of + "is converted from " +
           shown_unit(own) + " to " + shown_unit(wanted));
    } else if (own.empty() != wanted.empty()) {
      tell("the component " + in_quotes(variable(v).name) + of +
           (own.empty() ? "has no unit: it is taken to be in " + shown_unit(wanted)
                        : "is in " + shown_unit(own) +
                              ", but the others have no unit: they are taken to be"));
    }
  }

  void add_scalar(int v) {
    const FileVariable& source = variable(v);
    FieldPlan plan;
    plan.info.name = source.name;
    plan.info.components = {source.name};
    plan.info.units = source.units;
    plan.info.component_units = {source.units};
    plan.info.standard_name = source.standard_name;
    plan.info.long_name = source.long_name;
    plan.info.dtype = dtype_of(source);
    plan.variables = {v};
    plan.factors = {1};
    plans_.push_back(std::move(plan));
  }

  // Identifies components by the attribute of the netCDF writer: "<name> <index>".
  void by_mark() {
    for (const int v : variables_) {
      const std::string& mark = variable(v).vector_mark;
      if (is_used(v) || !mark.ends_with(" 0")) {
        continue;
      }
      const std::string name = mark.substr(0, mark.size() - 2);
      const auto component = [&](const char* index) {
        return partner(v, name + index, [](const FileVariable& f) { return f.vector_mark; });
      };
      const int second = component(" 1");
      int third = component(" 2");
      if (third >= 0 && !joins(v, third, true)) third = -1;
      if (!name.empty() && second >= 0 && joins(v, second, false)) {
        add_vector(name,
                   third >= 0 ? std::vector<int>{v, second, third} : std::vector<int>{v, second});
      }
    }
  }

  [[nodiscard]] int rising_air(int like) const {
    const int up = standing_for(like, "upward_air_velocity");
    return up >= 0 ? up : standing_for(like, std::string(omega_name));
  }

  // Identifies components by pairs of standard_name: eastward_Q/northward_Q, x_Q/y_Q, Q_x_R/Q_y_R.
  void by_standard_name() {
    for (const int v : variables_) {
      const std::string& name = variable(v).standard_name;
      if (is_used(v)) {
        continue;
      }
      std::string second;
      std::string third;
      std::string quantity;
      const auto x_token = name.find("_x_");
      if (name.starts_with("eastward_")) {
        quantity = name.substr(9);
        second = "northward_" + quantity;
        third = "upward_" + quantity;
      } else if (name.starts_with("x_")) {
        quantity = name.substr(2);
        second = "y_" + quantity;
        third = "upward_" + quantity;
      } else if (x_token != std::string::npos) {
        quantity = name.substr(0, x_token) + name.substr(x_token + 2);
        second = name.substr(0, x_token) + "_y_" + name.substr(x_token + 3);
        third = "upward_" + quantity;
      } else {
        continue;
      }
      const int y = standing_for(v, second);
      if (y < 0 || !joins(v, y, false)) {
        continue;
      }
      int z = quantity == "wind" ? rising_air(v) : standing_for(v, third);
      if (z >= 0 && !joins(v, z, true)) z = -1;
      if (z < 0) {  // the vertical component often lacks standard_name
        const std::string short_name = lower(variable(v).name);
        z = vertical_partner(v, short_name.starts_with('u') ? short_name.substr(1) : "");
      }
      const std::string shown = contains(quantity, "sea_water_velocity") ? "current" : quantity;
      add_vector(shown, z >= 0 ? std::vector<int>{v, y, z} : std::vector<int>{v, y});
    }
  }

  // Ex Ey Ez, b_x b_y b_z, velocity_x velocity_y ...: named by the common stem.
  void by_suffix(int v) {
    const std::string name = lower(variable(v).name);
    if (is_used(v) || name.size() < 2 || name.back() != 'x') {
      return;
    }
    const std::string stem = name.substr(0, name.size() - 1);
    const int y = named(v, stem + 'y');
    if (y < 0 || !joins(v, y, false)) {
      return;
    }
    int z = named(v, stem + 'z');
    if (z >= 0 && !joins(v, z, true)) z = -1;
    std::string shown = variable(v).name.substr(0, stem.size());
    while (shown.size() > 1 && (shown.back() == '_' || shown.back() == '-')) {
      shown.pop_back();
    }
    add_vector(shown, z >= 0 ? std::vector<int>{v, y, z} : std::vector<int>{v, y});
  }

  // u.../v...: u v, ua va, uwnd vwnd, ugrd vgrd, uo vo, U_GRD_6_ISBL V_GRD_6_ISBL ...
  void by_first_letter(int v) {
    const std::string name = lower(variable(v).name);
    if (is_used(v) || name.empty() || name.front() != 'u') {
      return;
    }
    const std::string rest = name.substr(1);
    const int y = named(v, 'v' + rest);
    if (y < 0 || !joins(v, y, false)) {
      return;
    }
    const int z = vertical_partner(v, rest);
    const bool flows = is_velocity(variable(v).units);
    const bool in_water = vertical_ == AxisKind::depth || rest == "o" ||
                          contains(lower(variable(v).long_name), "current") ||
                          contains(lower(variable(v).long_name), "sea water");
    const std::string shown = !flows ? "uv" + rest : in_water ? "current" : "wind";
    add_vector(shown, z >= 0 ? std::vector<int>{v, y, z} : std::vector<int>{v, y});
  }

  // w... with the same rest, otherwise a common name of vertical velocity.
  [[nodiscard]] int vertical_partner(int v, const std::string& rest) {
    const int alike = named(v, 'w' + rest);
    const bool is_third = alike >= 0 && joins(v, alike, true);
    if (is_third || !is_velocity(variable(v).units)) {
      return is_third ? alike : -1;
    }
    for (const char* usual : {"w", "wa", "wap", "omega", "vvel", "dzdt", "wwnd", "wgrd"}) {
      const int found = named(v, usual);
      if (found >= 0 && joins(v, found, true)) {
        return found;
      }
    }
    return -1;
  }

  const FileContents& contents_;
  const std::vector<int>& variables_;
  AxisKind vertical_;
  std::vector<std::string>& notes_;
  std::vector<FieldPlan> plans_;
};

}  // namespace

bool is_velocity_component(const FileVariable& variable) {
  const std::string& name = variable.standard_name;
  const bool of_flow = contains(name, "wind") || contains(name, "velocity");
  if (of_flow && (name.starts_with("eastward_") || name.starts_with("northward_") ||
                  name.starts_with("upward_") || name.starts_with("x_") || name.starts_with("y_") ||
                  contains(name, "_x_") || contains(name, "_y_"))) {
    return true;
  }
  constexpr auto usual = std::to_array<std::string_view>(
      {"u",        "v",        "w",        "ua",   "va",   "wa",   "uo",   "vo",
       "wo",       "uwnd",     "vwnd",     "ugrd", "vgrd", "uvel", "vvel", "wvel",
       "vozocrtx", "vomecrty", "vovecrtz", "ucx",  "ucy",  "ucz"});
  return is_speed(variable.units) && is_one_of(lower(variable.name), usual);
}

std::vector<FieldPlan> find_fields(const FileContents& contents, const std::vector<int>& variables,
                                   AxisKind vertical, std::vector<std::string>& notes) {
  return FieldFinder(contents, variables, vertical, notes).find();
}

}  // namespace windsplat::data::cf
