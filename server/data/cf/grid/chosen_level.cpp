// The coordinate of a chosen level has lost its dimension: it becomes an axis of length 1 again.
#include "server/data/cf/grid/chosen_level.hpp"

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
  FileContents level;
  level.dimensions.push_back({.name = out.name, .length = 1});
  level.variables.push_back(variable);
  level.variables.front().dims = {0};
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

}  // namespace windsplat::data::cf
