// Recognises the components of a vector in three ways, the most reliable first.
#include "server/data/cf/fields/fields.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/array_file.hpp"
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

// Variables on one grid, by texts of theirs, of which some are components of vectors.
class Candidates {
 public:
  using Index = std::unordered_map<std::string, std::vector<int>>;  // in the order of the file

  Candidates(const FileContents& contents, const std::vector<int>& variables)
      : contents_(contents), used_(contents.variables.size()) {
    for (const int v : variables) {
      const FileVariable& one = variable(v);
      by_name_[lower(one.name)].push_back(v);
      by_standard_name_[one.standard_name].push_back(v);
      by_mark_[one.vector_mark].push_back(v);
    }
  }

  [[nodiscard]] const FileVariable& variable(int v) const {
    return contents_.variables.at(static_cast<std::size_t>(v));
  }
  [[nodiscard]] bool is_used(int v) const { return used_[static_cast<std::size_t>(v)]; }
  void use(const std::vector<int>& components) {
    for (const int v : components) used_[static_cast<std::size_t>(v)] = true;
  }

  // An unused variable on the dimensions of `like`, in any order, with that name in lower case,
  // standard name or mark; -1 if there is none.
  [[nodiscard]] int named(int like, const std::string& name) const {
    return partner(like, name, by_name_);
  }
  [[nodiscard]] int standing_for(int like, const std::string& standard_name) const {
    return partner(like, standard_name, by_standard_name_);
  }
  [[nodiscard]] int marked(int like, const std::string& mark) const {
    return partner(like, mark, by_mark_);
  }

 private:
  [[nodiscard]] int partner(int like, const std::string& wanted, const Index& index) const {
    const auto found = index.find(wanted);
    if (found == index.end()) return -1;
    for (const int v : found->second) {
      const auto& dims = variable(v).dims;
      const auto& same = variable(like).dims;
      if (v != like && !is_used(v) && variable(v).process == variable(like).process &&
          variable(v).level == variable(like).level &&
          std::is_permutation(dims.begin(), dims.end(), same.begin(), same.end())) {
        return v;
      }
    }
    return -1;
  }

  const FileContents& contents_;
  std::vector<bool> used_;  // by variable
  Index by_name_;
  Index by_standard_name_;
  Index by_mark_;
};

// Names different from those of all variables and vectors, since views refer to fields by name.
class FieldNames {
 public:
  FieldNames(const FileContents& contents, const std::vector<int>& variables) {
    for (const int v : variables) {
      taken_.insert(contents.variables.at(static_cast<std::size_t>(v)).name);
    }
  }
  [[nodiscard]] std::string free_name(const std::string& wanted) {
    std::string name = wanted;
    const std::string base = wanted + "_vector";
    for (std::size_t& n = numbers_[wanted]; taken_.count(name) > 0; ++n) {
      name = n == 0 ? base : base + '_' + std::to_string(n + 1);
    }
    taken_.insert(name);
    return name;
  }

 private:
  std::unordered_set<std::string> taken_;
  std::unordered_map<std::string, std::size_t> numbers_;  // those tried, by name
};

// The name of a flow by the long name of its first component, in lower case, and what is left of
// the component's name. A "zonal velocity" may be of air or of water: unless the levels are
// pressures, the vector takes the word of the file.
std::string flow_name(const std::string& long_name, const std::string& rest, AxisKind vertical) {
  if (vertical == AxisKind::depth || rest == "o" || contains(long_name, "current") ||
      contains(long_name, "sea water")) {
    return "current";
  }
  const bool of_either = contains(long_name, "velocity") && !contains(long_name, "wind");
  return of_either && vertical != AxisKind::pressure ? "velocity" : "wind";
}

class FieldFinder {
 public:
  FieldFinder(const FileContents& contents, const std::vector<int>& variables, AxisKind vertical,
              std::vector<std::string>& notes)
      : contents_(contents),
        variables_(variables),
        vertical_(vertical),
        notes_(notes),
        candidates_(contents, variables),
        names_(contents, variables) {}

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
    if (untold_ > 0) {
      notes_.push_back(std::to_string(untold_) + " more notes on components of vectors");
    }
    return std::move(plans_);
  }

 private:
  [[nodiscard]] const FileVariable& variable(int v) const {
    return contents_.variables.at(static_cast<std::size_t>(v));
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
    constexpr std::size_t told_max = 40;
    if (!told_notes_.insert(note).second) return;
    if (told_++ < told_max) {
      notes_.push_back(std::move(note));
    } else {
      ++untold_;
    }
  }

  [[nodiscard]] static std::string dtype_of(const FileVariable& variable) {
    return variable.type + (variable.packed ? " packed" : "");
  }

  void add_vector(const std::string& name, std::vector<int> components) {
    FieldPlan plan;
    const FileVariable& first = variable(components.front());
    plan.info.name = names_.free_name(first.process.empty() ? name : name + "_" + first.process);
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
    candidates_.use(components);
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
      if (candidates_.is_used(v) || !mark.ends_with(" 0")) {
        continue;
      }
      const std::string name = mark.substr(0, mark.size() - 2);
      const auto component = [&](const char* index) { return candidates_.marked(v, name + index); };
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
    const int up = candidates_.standing_for(like, "upward_air_velocity");
    return up >= 0 ? up : candidates_.standing_for(like, std::string(omega_name));
  }

  // Identifies components by pairs of standard_name: eastward_Q/northward_Q, x_Q/y_Q, Q_x_R/Q_y_R.
  void by_standard_name() {
    for (const int v : variables_) {
      const std::string& name = variable(v).standard_name;
      if (candidates_.is_used(v)) {
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
      const int y = candidates_.standing_for(v, second);
      if (y < 0 || !joins(v, y, false)) {
        continue;
      }
      int z = quantity == "wind" ? rising_air(v) : candidates_.standing_for(v, third);
      if (z >= 0 && !joins(v, z, true)) z = -1;
      if (z < 0) {  // the vertical component often lacks standard_name
        const std::string short_name = lower(variable(v).name);
        z = vertical_partner(v, y, short_name.starts_with('u') ? short_name.substr(1) : "");
      }
      const std::string shown = contains(quantity, "sea_water_velocity") ? "current" : quantity;
      add_vector(shown, z >= 0 ? std::vector<int>{v, y, z} : std::vector<int>{v, y});
    }
  }

  // Ex Ey Ez, b_x b_y b_z, velocity_x velocity_y ...: named by the common stem.
  void by_suffix(int v) {
    const std::string name = lower(variable(v).name);
    if (candidates_.is_used(v) || name.size() < 2 || name.back() != 'x') {
      return;
    }
    const std::string stem = name.substr(0, name.size() - 1);
    const int y = candidates_.named(v, stem + 'y');
    if (y < 0 || !joins(v, y, false)) {
      return;
    }
    int z = candidates_.named(v, stem + 'z');
    const bool of_schism = stem == "horizontalvel";
    if (z < 0 && of_schism) z = candidates_.named(v, "verticalvelocity");
    if (z >= 0 && !joins(v, z, true)) z = -1;
    std::string shown = of_schism ? "current" : variable(v).name.substr(0, stem.size());
    while (shown.size() > 1 && (shown.back() == '_' || shown.back() == '-')) {
      shown.pop_back();
    }
    add_vector(shown, z >= 0 ? std::vector<int>{v, y, z} : std::vector<int>{v, y});
  }

  // u.../v...: u v, ua va, uwnd vwnd, ugrd vgrd, uo vo, U_GRD_6_ISBL V_GRD_6_ISBL ...
  void by_first_letter(int v) {
    const std::string name = lower(variable(v).name);
    if (candidates_.is_used(v) || name.empty() || name.front() != 'u') {
      return;
    }
    const std::string rest = name.substr(1);
    const int y = candidates_.named(v, 'v' + rest);
    if (y < 0 || !joins(v, y, false)) {
      return;
    }
    const int z = vertical_partner(v, y, rest);
    const std::string shown = is_velocity(variable(v).units)
                                  ? flow_name(lower(variable(v).long_name), rest, vertical_)
                                  : "uv" + rest;
    add_vector(shown, z >= 0 ? std::vector<int>{v, y, z} : std::vector<int>{v, y});
  }

  // w... with the same rest, otherwise a common name of vertical velocity. second: the other
  // horizontal component, which may have one of these names (VVEL of POP and CICE).
  [[nodiscard]] int vertical_partner(int v, int second, const std::string& rest) {
    const int alike = candidates_.named(v, 'w' + rest);
    const bool is_third = alike >= 0 && joins(v, alike, true);
    if (is_third || !is_velocity(variable(v).units)) {
      return is_third ? alike : -1;
    }
    for (const char* usual : {"w", "wa", "wap", "omega", "vvel", "dzdt", "wwnd", "wgrd"}) {
      const int found = candidates_.named(v, usual);
      if (found >= 0 && found != second && joins(v, found, true)) {
        return found;
      }
    }
    return -1;
  }

  const FileContents& contents_;
  const std::vector<int>& variables_;
  AxisKind vertical_;
  std::vector<std::string>& notes_;
  Candidates candidates_;
  FieldNames names_;
  std::unordered_set<std::string> told_notes_;
  std::size_t told_ = 0;
  std::size_t untold_ = 0;
  std::vector<FieldPlan> plans_;
};

}  // namespace

bool has_velocity_name(const FileVariable& variable) {
  constexpr auto usual = std::to_array<std::string_view>(
      {"u",    "v",   "w",   "ua",   "va",       "wa",       "uo",      "vo",   "wo",
       "ut",   "vt",  "wt",  "uwnd", "vwnd",     "ugrd",     "vgrd",    "uvel", "vvel",
       "wvel", "ucx", "ucy", "ucz",  "vozocrtx", "vomecrty", "vovecrtz"});
  return is_one_of(lower(variable.name), usual);
}

bool is_velocity_component(const FileVariable& variable) {
  const std::string& name = variable.standard_name;
  const bool of_flow = contains(name, "wind") || contains(name, "velocity");
  if (of_flow && (name.starts_with("eastward_") || name.starts_with("northward_") ||
                  name.starts_with("upward_") || name.starts_with("x_") || name.starts_with("y_") ||
                  contains(name, "_x_") || contains(name, "_y_"))) {
    return true;
  }
  constexpr auto of_schism = std::to_array<std::string_view>(  // which writes no units
      {"horizontalvelx", "horizontalvely", "verticalvelocity"});
  return (is_speed(variable.units) && has_velocity_name(variable)) ||
         (is_velocity(variable.units) && is_one_of(lower(variable.name), of_schism));
}

namespace {

// Whether a variable may be a component of a velocity whose name tells nothing: its units are those
// of a speed, and no name says that it is another quantity.
bool may_be_component(const FileVariable& variable) {
  constexpr auto others =
      std::to_array<std::string_view>({"speed", "gust", "rate", "precipitation"});
  const std::string names = lower(variable.name + ' ' + variable.long_name);
  const std::string& standard = variable.standard_name;
  const bool of_flow =
      standard.empty() || contains(standard, "wind") || contains(standard, "velocity");
  return is_speed(variable.units) && of_flow &&
         std::none_of(others.begin(), others.end(), [&](std::string_view other) {
           return contains(names, other) || contains(standard, other);
         });
}

// Of data without a vector: a note on the fields that may be its components, at least two.
void tell_unnamed_components(const FileContents& contents, const std::vector<FieldPlan>& plans,
                             std::vector<std::string>& notes) {
  constexpr std::size_t names_told_max = 6;
  std::string names;
  std::size_t count = 0;
  for (const FieldPlan& plan : plans) {
    if (plan.info.kind == FieldKind::vector) return;
    const FileVariable& variable =
        contents.variables.at(static_cast<std::size_t>(plan.variables.front()));
    if (!may_be_component(variable) || ++count > names_told_max) continue;
    names += (names.empty() ? "" : ", ") + in_quotes(variable.name);
  }
  if (count < 2) return;
  if (count > names_told_max) names += " and " + std::to_string(count - names_told_max) + " more";
  notes.push_back("no vector field was found: if " + names +
                  " are components of a velocity, give them a standard_name such as x_wind and "
                  "y_wind (docs/user/faq.md)");
}

}  // namespace

std::string absent_components_note(const FileContents& contents,
                                   const std::vector<LeftOut>& left_out,
                                   const std::vector<int>& shown) {
  std::string text;
  for (const LeftOut& left : left_out) {
    const int v = variable_named(contents, left.name);
    if (v < 0 || !is_velocity_component(contents.variables[at(v)])) continue;
    if (std::find(shown.begin(), shown.end(), v) != shown.end()) continue;
    text += (text.empty() ? "components of a velocity are not shown: " : "; ") +
            in_quotes(left.name) + ": " + left.reason;
  }
  return text;
}

std::vector<FieldPlan> find_fields(const FileContents& contents, const std::vector<int>& variables,
                                   AxisKind vertical, std::vector<std::string>& notes) {
  std::vector<FieldPlan> plans = FieldFinder(contents, variables, vertical, notes).find();
  tell_unnamed_components(contents, plans, notes);
  return plans;
}

}  // namespace windsplat::data::cf
