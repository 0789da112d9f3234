// Finds coefficients and surface pressure by formula terms or common names.
#include "server/data/cf/grid/vertical.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

constexpr double usual_reference_pa = 100000.0;
constexpr double fraction_max = 2.0;  // coefficients above this are not fractions of a pressure

int term_variable(const FileContents& contents, std::string_view name) {
  return name.empty() ? -1 : variable_named(contents, name);
}

// Terms by the attributes of NCL and by common names, for files without formula_terms.
std::map<std::string, std::string> usual_terms(const ArrayFile& file, int coordinate,
                                               const Placement& grid) {
  std::map<std::string, std::string> terms;
  constexpr std::array<std::pair<const char*, const char*>, 4> attributes{
      {{"a", "A_var"}, {"b", "B_var"}, {"p0", "P0_var"}, {"ps", "PS_var"}}};
  for (const auto& [term, attribute] : attributes) {
    const std::string name = coordinate < 0 ? "" : file.text_of(coordinate, attribute);
    if (!name.empty()) terms[term] = name;
  }
  const FileContents& contents = file.contents();
  for (const auto& [a, b] : {std::pair("hyam", "hybm"), std::pair("hyai", "hybi")}) {
    const int v = term_variable(contents, a);
    const bool on_levels = v >= 0 && contents.variables[at(v)].dims == std::vector{grid.space[2]};
    if (terms.count("a") == 0 && on_levels && term_variable(contents, b) >= 0) {
      terms["a"] = a;
      terms["b"] = b;
      terms["p0"] = "P0";
    }
  }
  if (terms.count("a") != 0 && term_variable(contents, terms["ps"]) < 0) {
    const int surface = find_surface_pressure(contents, grid);
    if (surface >= 0) terms["ps"] = contents.variables[at(surface)].name;
  }
  return terms;
}

// Reads one value per level, lowest level first; empty if the variable has other dimensions.
Result<std::vector<double>> on_levels(const ArrayFile& file, const Placement& grid,
                                      const std::string& name) {
  const int v = term_variable(file.contents(), name);
  if (v < 0 || !file.contents().variables[at(v)].numeric ||
      file.contents().variables[at(v)].dims != std::vector{grid.space[2]}) {
    return std::vector<double>();
  }
  auto values = unpacked_values(file, v);
  if (!values) return values;
  if (grid.turned[2]) std::reverse(values->begin(), values->end());
  return values;
}

// A pressure variable as stored, and its unit in Pa if given.
struct Single {
  double value = 0;
  std::optional<double> unit_pa;
};

// Reads a single pressure; empty if the file has no such number.
Result<std::optional<Single>> single_pressure(const ArrayFile& file, const std::string& name) {
  using Found = std::optional<Single>;
  const int v = term_variable(file.contents(), name);
  if (v < 0 || !file.contents().variables[at(v)].numeric) return Found();
  const FileVariable& variable = file.contents().variables[at(v)];
  for (const int d : variable.dims) {
    if (file.contents().dimensions[at(d)].length != 1) return Found();
  }
  auto values = unpacked_values(file, v);
  if (!values) return values.error();
  if (values->size() != 1 || !std::isfinite(values->front())) return Found();
  return Found({values->front(), pascals_in(variable.units)});
}

// The reference pressure in Pa; 1000 hPa if it is not in the file.
Result<double> reference_pressure(const ArrayFile& file, const std::string& name,
                                  std::string& note) {
  const auto found = single_pressure(file, name);
  if (!found) return found.error();
  if (*found) {
    const Single& p0 = **found;
    // A reference pressure is near 1000 hPa: its magnitude implies a missing unit.
    return p0.value * (p0.unit_pa ? *p0.unit_pa : p0.value < 2000 ? 100.0 : 1.0);
  }
  note += "; no reference pressure in the file: using 1000 hPa";
  return usual_reference_pa;
}

// The pressure at the top in Pa; 0 if it is not in the file. Without units, those of the surface
// pressure are assumed.
Result<double> top_pressure(const ArrayFile& file, const std::string& name, int surface,
                            std::string& note) {
  const auto found = single_pressure(file, name);
  if (!found) return found.error();
  if (!*found) {
    note += name.empty() ? "; formula_terms has no pressure at the top"
                         : "; the pressure at the top, " + in_quotes(name) + ", is not in the file";
    note += ": using 0";
    return 0.0;
  }
  if ((*found)->unit_pa) return (*found)->value * *(*found)->unit_pa;
  const std::string& units = file.contents().variables[at(surface)].units;
  return (*found)->value * pascals_in(units).value_or(1);
}

bool finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

// p = ptop + sigma (ps - ptop).
Result<bool> sigma_levels(const ArrayFile& file, const Placement& grid,
                          std::map<std::string, std::string>& terms, HybridLevels& out) {
  auto sigma = on_levels(file, grid, terms["sigma"]);
  if (!sigma) return sigma.error();
  if (sigma->empty()) return false;
  auto top = top_pressure(file, terms["ptop"], out.surface, out.note);
  if (!top) return top.error();
  for (const double s : *sigma) {
    out.a.push_back(*top * (1 - s));
    out.b.push_back(s);
  }
  return true;
}

// p = a p0 + b ps, or ap + b ps.
Result<bool> hybrid_levels(const ArrayFile& file, const Placement& grid,
                           std::map<std::string, std::string>& terms, HybridLevels& out) {
  const std::string& a_name = terms.count("ap") != 0 ? terms["ap"] : terms["a"];
  auto a = on_levels(file, grid, a_name);
  if (!a) return a.error();
  auto b = on_levels(file, grid, terms["b"]);
  if (!b) return b.error();
  if (a->empty() || b->empty()) return false;
  out.coefficients = {term_variable(file.contents(), a_name),
                      term_variable(file.contents(), terms["b"])};
  const std::string& units = file.contents().variables[at(out.coefficients[0])].units;
  const double most = std::abs(*std::max_element(
      a->begin(), a->end(), [](double x, double y) { return std::abs(x) < std::abs(y); }));
  double scale = 1;
  if (const auto unit = pascals_in(units)) {
    scale = *unit;
  } else if (most <= fraction_max) {
    auto reference = reference_pressure(file, terms["p0"], out.note);
    if (!reference) return reference.error();
    scale = *reference;
  }
  for (double& value : *a) value *= scale;
  out.a = std::move(*a);
  out.b = std::move(*b);
  return true;
}

}  // namespace

std::map<std::string, std::string> formula_terms(const std::string& text) {
  std::map<std::string, std::string> terms;
  std::string term;
  std::size_t from = 0;
  while (from < text.size()) {
    const std::size_t to = std::min(text.find_first_of(" \t\n\r", from), text.size());
    std::string word = text.substr(from, to - from);
    from = to + 1;
    if (word.empty()) continue;
    if (word.back() == ':') {
      word.pop_back();
      term = lower(word);
    } else if (!term.empty()) {
      terms[term] = word;
      term.clear();
    }
  }
  return terms;
}

bool on_columns(const FileContents& contents, const Placement& grid, int variable) {
  const FileVariable& found = contents.variables[at(variable)];
  std::size_t horizontal = 0;
  for (const int d : found.dims) {
    const bool here = d == grid.space[0] || d == grid.space[1];
    horizontal += here ? 1 : 0;
    if (!here && d != grid.time && contents.dimensions[at(d)].length != 1) return false;
  }
  const std::size_t wanted = (grid.space[0] >= 0 ? 1U : 0U) + (grid.space[1] >= 0 ? 1U : 0U);
  return found.numeric && horizontal == wanted;
}

bool is_surface_pressure(const FileVariable& variable) {
  const std::string name = lower(variable.name);
  const bool usual = name == "ps" || name == "sp" || name == "psfc" || name == "pres_sfc" ||
                     lower(variable.long_name) == "surface pressure";
  return variable.standard_name == "surface_air_pressure" ||
         (usual && (variable.units.empty() || pascals_in(variable.units)));
}

int find_surface_pressure(const FileContents& contents, const Placement& grid) {
  int named = -1;
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& variable = contents.variables[v];
    if (!on_columns(contents, grid, static_cast<int>(v))) continue;
    if (variable.standard_name == "surface_air_pressure") return static_cast<int>(v);
    if (named < 0 && is_surface_pressure(variable)) named = static_cast<int>(v);
  }
  return named;
}

Result<std::optional<HybridLevels>> find_hybrid(const ArrayFile& file, const Placement& grid,
                                                int coordinate) {
  using Found = std::optional<HybridLevels>;
  if (grid.space[2] < 0) return Found();
  auto terms = formula_terms(coordinate < 0 ? "" : file.text_of(coordinate, "formula_terms"));
  const bool by_formula = terms.count("ps") != 0;
  if (!by_formula) terms = usual_terms(file, coordinate, grid);
  HybridLevels out;
  out.surface = term_variable(file.contents(), terms["ps"]);
  const int of_formula = out.surface;
  if (by_formula && of_formula >= 0 && !on_columns(file.contents(), grid, of_formula)) {
    out.surface = find_surface_pressure(file.contents(), grid);
  }
  if (out.surface < 0 || !on_columns(file.contents(), grid, out.surface)) return Found();
  const auto made = terms.count("sigma") != 0 ? sigma_levels(file, grid, terms, out)
                                              : hybrid_levels(file, grid, terms, out);
  if (!made) return made.error();
  if (!*made || !finite(out.a) || !finite(out.b)) return Found();
  const FileVariable& surface = file.contents().variables[at(out.surface)];
  out.units = surface.units.empty() ? "Pa" : surface.units;
  const auto unit = pascals_in(out.units);
  if (!unit) return Found();
  out.unit_pa = *unit;
  std::string note =
      "terrain-following levels: the vertical axis has their pressures for the mean of ";
  note += in_quotes(surface.name) + " at the first step" + out.note;
  if (out.surface != of_formula) {
    note += "; " + in_quotes(file.contents().variables[at(of_formula)].name) +
            " of the formula lies on another grid";
  }
  if (!by_formula) note += "; without formula_terms, identified by common names";
  out.note = std::move(note);
  return Found(std::move(out));
}

Result<std::optional<LogarithmicLevels>> find_logarithmic(const ArrayFile& file,
                                                          const Placement& grid, int coordinate) {
  using Found = std::optional<LogarithmicLevels>;
  if (coordinate < 0 || grid.space[2] < 0 ||
      file.contents().variables[at(coordinate)].standard_name !=
          "atmosphere_ln_pressure_coordinate") {
    return Found();
  }
  auto terms = formula_terms(file.text_of(coordinate, "formula_terms"));
  auto levels = on_levels(file, grid, terms["lev"]);
  if (!levels) return levels.error();
  if (levels->empty()) return Found();
  LogarithmicLevels out;
  const auto reference = reference_pressure(file, terms["p0"], out.note);
  if (!reference) return reference.error();
  for (const double level : *levels) out.pressures.push_back(*reference * std::exp(-level));
  return Found(std::move(out));
}

}  // namespace windsplat::data::cf
