// Adds a new dimension, because the library assigns one dimension to all arrays of equal length, so
// that the steps of one array may share a dimension with the rows of another.
#include "server/data/formats/netcdf/bare.hpp"

#include <algorithm>
#include <map>
#include <string>

#include "server/base/error.hpp"

namespace windsplat::data::netcdf {

namespace {

constexpr std::size_t components_max = 4;

}  // namespace

bool is_bare(const FileDimension& dimension) { return dimension.name.starts_with("phony_dim_"); }

void name_steps_of_bare_arrays(FileContents& contents) {
  auto& dimensions = contents.dimensions;
  if (!std::all_of(dimensions.begin(), dimensions.end(), is_bare)) return;
  const auto at = [](int index) { return static_cast<std::size_t>(index); };
  std::map<std::size_t, int> times;  // keyed by length
  for (FileVariable& variable : contents.variables) {
    if (!variable.numeric || variable.dims.size() != 4) continue;
    const bool grows = std::any_of(variable.dims.begin(), variable.dims.end(),
                                   [&](int d) { return dimensions.at(at(d)).unlimited; });
    if (grows || dimensions.at(at(variable.dims.back())).length <= components_max) continue;
    const std::size_t length = dimensions.at(at(variable.dims.front())).length;
    const auto [found, is_new] = times.emplace(length, static_cast<int>(dimensions.size()));
    if (is_new) {
      FileDimension time;
      time.name = times.size() == 1 ? "time" : "time" + std::to_string(times.size());
      time.length = length;
      dimensions.push_back(std::move(time));
      contents.notes.push_back("dimensions have no names: of " + in_quotes(variable.name) +
                               " and others with four, the first is interpreted as time");
    }
    variable.dims.front() = found->second;
  }
}

}  // namespace windsplat::data::netcdf
