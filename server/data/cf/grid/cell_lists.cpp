#include "server/data/cf/grid/cell_lists.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "server/base/ascii.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/grid/axes.hpp"

namespace windsplat::data::cf {

namespace {

// MPAS, ICON, FESOM, FVCOM, SCHISM.
constexpr auto usual_names =
    std::to_array<std::string_view>({"ncells", "nedges", "nvertices", "nod2", "nod2d", "nodes_2d",
                                     "nod_n", "nele", "nschism_hgrid_node", "nschism_hgrid_face"});

bool is_connectivity(const FileVariable& variable) {
  return lower(variable.cf_role).ends_with("_connectivity");
}

}  // namespace

int side_of(const FileVariable& variable) {
  const std::string units = lower(variable.units);
  const std::string standard_name = lower(variable.standard_name);
  const std::string name = lower(variable.name);
  if (standard_name == "longitude" || is_east(units)) return -1;
  if (standard_name == "latitude" || is_position(variable)) return 1;
  if (!is_radian(units)) return 0;
  if (name.find("lon") != std::string::npos) return -1;
  return name.find("lat") != std::string::npos ? 1 : 0;
}

std::vector<bool> find_cell_lists(const FileContents& contents) {
  const std::size_t count = contents.dimensions.size();
  std::vector<bool> found(count, false);
  std::vector<std::array<bool, 2>> placed(count, {false, false});  // by longitude, by latitude
  // Beside the coordinate of an axis, others on it are auxiliary; samples along `x` lie in order.
  const auto is_own_axis = [&](int dimension) {
    const std::string& name = contents.dimensions.at(at(dimension)).name;
    const int axis = variable_named(contents, name);
    return is_one_of(lower(name), std::to_array<std::string_view>({"x", "y"})) ||
           (axis >= 0 && side_of(contents.variables[at(axis)]) != 0);
  };
  for (const FileVariable& variable : contents.variables) {
    if (variable.dims.size() == 1 && variable.numeric && !is_own_axis(variable.dims[0])) {
      const int side = side_of(variable);
      if (side != 0) placed.at(at(variable.dims[0])).at(side < 0 ? 0 : 1) = true;
    }
    // The nodes of each cell, or the cells of each node: the list is the longer dimension.
    if (variable.dims.size() == 2 && is_connectivity(variable)) {
      const auto length = [&](int d) { return contents.dimensions.at(at(d)).length; };
      const bool first = length(variable.dims[0]) >= length(variable.dims[1]);
      found.at(at(variable.dims[first ? 0 : 1])) = true;
    }
    if (!variable.mesh.empty() && !variable.dims.empty()) {
      found.at(at(variable.dims.back())) = true;
    }
  }
  for (std::size_t d = 0; d < count; ++d) {
    const bool named = is_one_of(lower(contents.dimensions[d].name), usual_names);
    found[d] =
        found[d] || named || (placed[d][0] && placed[d][1]) || contents.dimensions[d].is_list;
  }
  return found;
}

std::string known_grid_uuid(const std::string& text) {
  constexpr std::size_t digits = 32;
  std::string out;
  for (const char c : lower(text)) {
    if ((c >= '0' && c <= '9') || (c >= 'a' && c <= 'f')) out += c;
  }
  const bool is_known =
      out.size() == digits && out != std::string(digits, '0') && out != std::string(digits, 'f');
  return is_known ? out : std::string();
}

bool are_of_different_grids(const FileDimension& a, const FileDimension& b) {
  return !a.grid_uuid.empty() && !b.grid_uuid.empty() && a.grid_uuid != b.grid_uuid;
}

std::string problem_of_list(const FileDimension& list) {
  std::string out = "its dimension " + in_quotes(list.name) +
                    " lists stations, or cells, edges or nodes of an unstructured grid whose "
                    "outlines are not in the file";
  if (list.is_list) {
    out += "; join it with the file of the horizontal grid";
    if (!list.grid_uuid.empty()) out += " of UUID " + list.grid_uuid;
    out += ", '{grid.nc,data.grib2}'";
  }
  return out;
}

}  // namespace windsplat::data::cf
