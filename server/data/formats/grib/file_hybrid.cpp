// Hybrid levels of a file: their coefficients and the surface pressure as variables.
#include <algorithm>
#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/formats/grib/file.hpp"
#include "server/data/formats/grib/hybrid.hpp"

namespace windsplat::data::grib {

// Gives hybrid levels the terms of CF's atmosphere_hybrid_sigma_pressure_coordinate.
Result<void> File::add_hybrid_levels() {
  std::set<std::pair<int, std::size_t>> seen;  // dimensions on grids
  std::map<std::size_t, int> surfaces;         // of grids: the variable of the pressure, or -1
  std::map<int, bool> lacking;                 // dimensions: whether a grid has no pressure
  std::set<int> placed;                        // dimensions with a formula
  const std::size_t fields = contents_.variables.size();
  for (std::size_t v = 0; v < fields; ++v) {
    if (held_[v].group < 0) continue;
    const Group& group = groups_[static_cast<std::size_t>(held_[v].group)];
    const auto& axes = held_[v].axes;
    const auto at = std::find(axes.begin(), axes.end(), level_axis_index);
    if (group.header.level_type != "hybrid" || at == axes.end()) continue;
    const int levels = contents_.variables[v].dims[static_cast<std::size_t>(at - axes.begin())];
    if (!seen.insert({levels, group.grid}).second) continue;
    const auto pv = coefficients_of(group);
    if (!pv) return pv.error();
    const auto found = at_full_levels(*pv, group.axes[level_axis_index]);
    if (!found) continue;
    const std::string& name = contents_.dimensions[static_cast<std::size_t>(levels)].name;
    const auto [at_grid, is_new] = surfaces.try_emplace(group.grid, -1);
    if (is_new) at_grid->second = surface_pressure(group.grid);
    const int surface = at_grid->second;
    lacking[levels] = lacking[levels] || surface < 0;
    if (surface < 0 || !placed.insert(levels).second) continue;
    std::string formula;
    for (const auto& [term, values] : {std::pair("ap", &found->a), std::pair("b", &found->b)}) {
      FileVariable variable;
      variable.name = name + "_" + term;
      variable.type = "float64";
      variable.numeric = true;
      variable.dims = {levels};
      variable.units = std::string(term) == "ap" ? "Pa" : "1";
      formula += std::string(term) + ": " + variable.name + " ";
      contents_.variables.push_back(std::move(variable));
      held_.push_back({*values, -1, {}, -1, false, {}});
    }
    formula += "ps: " + contents_.variables[static_cast<std::size_t>(surface)].name;
    held_[static_cast<std::size_t>(cf::variable_named(contents_, name))].formula = formula;
  }
  for (const auto& [levels, is_lacking] : lacking) {
    if (!is_lacking) continue;
    const bool is_partial = placed.count(levels) != 0;
    contents_.notes.push_back(
        "the pressures of the levels " +
        in_quotes(contents_.dimensions[static_cast<std::size_t>(levels)].name) + " are unknown" +
        (is_partial ? " on grids where the file has neither 'sp' nor 'lnsp'"
                    : ": the file has neither 'sp' nor 'lnsp' on their grid"));
  }
  return {};
}

// Those of the first and the last message of a group; empty if they differ.
Result<std::vector<double>> File::coefficients_of(const Group& group) const {
  std::vector<double> out;
  for (const std::size_t field : {group.fields.begin()->second, group.fields.rbegin()->second}) {
    const auto message = read_message(*input_, places_[field]);
    if (!message) return message.error();
    auto found = read_coefficients(*message);
    if (!found) return input_->fault("has a message that " + found.error().message);
    if (!out.empty() && out != *found) return std::vector<double>();
    out = std::move(*found);
  }
  return out;
}

// The variable of the surface pressure on a grid: `sp`, or the exponential of `lnsp`, which is
// added; -1 if there is neither.
int File::surface_pressure(std::size_t grid) {
  const std::size_t fields = contents_.variables.size();
  for (const char* name : {"sp", "lnsp"}) {
    for (std::size_t v = 0; v < fields; ++v) {
      if (held_[v].group < 0 || held_[v].is_logarithm || !contents_.variables[v].numeric) continue;
      const Group& group = groups_[static_cast<std::size_t>(held_[v].group)];
      if (group.header.short_name != name || group.grid != grid) continue;
      if (group.header.short_name == "sp") return static_cast<int>(v);
      FileVariable pressure = contents_.variables[v];
      pressure.name = "surface_pressure";
      while (cf::variable_named(contents_, pressure.name) >= 0) pressure.name += '_';
      pressure.long_name = "surface pressure, from lnsp";
      pressure.standard_name = "surface_air_pressure";
      pressure.units = "Pa";
      contents_.variables.push_back(std::move(pressure));
      held_.push_back(held_[v]);
      held_.back().is_logarithm = true;
      return static_cast<int>(fields);
    }
  }
  return -1;
}

}  // namespace windsplat::data::grib
