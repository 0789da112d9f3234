// Identifies meep by the names of all arrays, since it writes no attributes.
#include "server/data/formats/netcdf/meep.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "server/data/formats/netcdf/bare.hpp"

namespace windsplat::data::netcdf {

namespace {

bool is_name_of_meep(std::string_view name) {
  if (name.ends_with(".r") || name.ends_with(".i")) name.remove_suffix(2);
  if (name == "eps" || name == "mu") return true;
  constexpr std::string_view quantities = "ehdbs";
  constexpr std::string_view directions = "xyz";
  return name.size() == 2 && quantities.find(name[0]) != std::string_view::npos &&
         directions.find(name[1]) != std::string_view::npos;
}

}  // namespace

void name_axes_of_meep(FileContents& contents) {
  const auto& variables = contents.variables;
  auto& dimensions = contents.dimensions;
  if (variables.empty() || dimensions.size() < 2 || dimensions.size() > 4 ||
      !std::all_of(dimensions.begin(), dimensions.end(), is_bare)) {
    return;
  }
  const std::vector<int>& order = variables.front().dims;
  const bool all_alike =
      order.size() == dimensions.size() &&
      std::all_of(variables.begin(), variables.end(), [&](const FileVariable& variable) {
        return variable.numeric && variable.dims == order && is_name_of_meep(variable.name);
      });
  if (!all_alike) return;
  const auto last = static_cast<std::size_t>(order.back());
  const bool in_time = dimensions.at(last).unlimited;
  if (order.size() == 4 && !in_time) return;
  constexpr std::array<const char*, 3> names{"x", "y", "z"};
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto at = static_cast<std::size_t>(order[i]);
    dimensions.at(at).name = in_time && i + 1 == order.size() ? "t" : names.at(i);
  }
  contents.notes.emplace_back(
      "dimensions have no names, but arrays have those of the solver meep: the first index is x, "
      "as "
      "written by meep");
}

}  // namespace windsplat::data::netcdf
