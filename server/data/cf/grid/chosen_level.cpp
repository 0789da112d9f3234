// The coordinate of a chosen level has lost its dimension: it becomes an axis of length 1 again.
#include "server/data/cf/grid/chosen_level.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/grid/axes.hpp"

namespace windsplat::data::cf {

namespace {

std::string name_of_level(const FileContents& contents, const std::vector<int>& shown) {
  std::string name;
  for (const int v : shown) {
    const FileVariable& variable = contents.variables[at(v)];
    if (variable.preferred) return variable.level;
    if (name.empty()) name = variable.level;
  }
  return name;
}

std::string note_of_others(const FileContents& contents, const std::vector<int>& shown,
                           const std::string& level) {
  constexpr std::size_t listed_max = 8;
  std::string text;
  std::size_t count = 0;
  for (const int v : shown) {
    const FileVariable& variable = contents.variables[at(v)];
    if (variable.level == level || ++count > listed_max) continue;
    text += (count == 1 ? "" : ", ") + in_quotes(variable.name);
  }
  if (count > listed_max) text += " and " + std::to_string(count - listed_max) + " more";
  return count == 0 ? "" : "not at the chosen level " + in_quotes(level) + ": " + text;
}

// A variable without dimensions as the coordinate of a dimension of length 1.
FileContents on_one_entry(const FileVariable& variable) {
  FileContents out;
  out.dimensions.push_back({.name = variable.name, .length = 1});
  out.variables.push_back(variable);
  out.variables.front().dims = {0};
  return out;
}

}  // namespace

Result<std::optional<ChosenLevel>> find_chosen_level(const ArrayFile& file,
                                                     const std::vector<int>& shown,
                                                     AxisKind horizontal) {
  const FileContents& contents = file.contents();
  ChosenLevel out;
  out.name = name_of_level(contents, shown);
  const int v = out.name.empty() ? -1 : variable_named(contents, out.name);
  if (v < 0) return std::optional<ChosenLevel>();
  const FileVariable& variable = contents.variables[at(v)];
  if (!variable.numeric || !variable.dims.empty()) return std::optional<ChosenLevel>();
  const FileContents level = on_one_entry(variable);
  const DimensionRole role = classify_dimensions(level).front();
  if (role.role != Role::z) return std::optional<ChosenLevel>();
  auto value = unpacked_values(file, v);
  if (!value) return value.error();
  auto oriented = orient_axis(level, role, 0, 2, std::move(*value), horizontal);
  if (!oriented) return oriented.error();
  out.axis = std::move(oriented->axis);
  out.note = note_of_others(contents, shown, out.name);
  return std::optional(std::move(out));
}

Result<std::optional<Axis>> find_chosen_latitude(const ArrayFile& file,
                                                 const std::vector<int>& shown) {
  std::optional<Axis> found;
  const FileContents& contents = file.contents();
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& variable = contents.variables[v];
    if (!variable.numeric || !variable.dims.empty()) continue;
    const bool is_named = std::any_of(shown.begin(), shown.end(), [&](int field) {
      const std::string words = ' ' + contents.variables[at(field)].coordinates + ' ';
      return words.find(' ' + variable.name + ' ') != std::string::npos;
    });
    if (!is_named && !variable.in_use) continue;
    const FileContents one = on_one_entry(variable);
    const DimensionRole role = classify_dimensions(one).front();
    if (role.role != Role::y || role.kind != AxisKind::latitude) continue;
    auto value = unpacked_degrees(file, static_cast<int>(v));
    if (!value) return value.error();
    if (value->size() != 1 || !(std::abs(value->front()) <= 90)) continue;
    if (found && found->coordinates != *value) return std::optional<Axis>();
    auto oriented = orient_axis(one, role, 0, 1, std::move(*value), AxisKind::longitude);
    if (!oriented) return oriented.error();
    found = std::move(oriented->axis);
  }
  return found;
}

}  // namespace windsplat::data::cf
