// Grids that are lists of cells: their positions, and fields that are the same at all times.
#include <algorithm>
#include <cstddef>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/data/formats/grib/file.hpp"

namespace windsplat::data::grib {

namespace {

constexpr const char* east_of_cells = "tlon";  // short names of discipline 0, category 191
constexpr const char* north_of_cells = "tlat";

// "HHL" is the name of the German weather service, centre 78.
bool is_height_of_levels(const Header& header) {
  return (header.short_name == "h" || header.short_name == "HHL") &&
         header.level_type.starts_with("generalVertical");
}

// Whether the fields of a group have one time.
bool has_one_time(const Group& group) {
  std::set<std::pair<double, double>> times;
  for (const auto& [place, field] : group.fields) {
    times.insert({place[reference_axis], place[time_axis]});
  }
  return times.size() == 1;
}

}  // namespace

// Positions of cells and heights of levels have the date of their making.
void File::fix_constants() {
  for (Group& group : groups_) {
    const std::string& name = group.header.short_name;
    const bool is_position =
        grids_[group.grid].is_list && (name == east_of_cells || name == north_of_cells);
    if ((!is_position && !is_height_of_levels(group.header)) || !has_one_time(group)) continue;
    group.is_constant = true;
    std::map<Place, std::size_t> fields;
    std::size_t unused = 0;
    for (const auto& [place, field] : group.fields) {
      Place at = place;
      at[reference_axis] = 0;
      at[time_axis] = 0;
      if (is_position) at[level_axis_index] = 0;
      unused += fields.emplace(at, field).second ? 0 : 1;
    }
    if (unused > 0) {
      contents_.notes.push_back(in_quotes(name) + " is given at " + std::to_string(unused + 1) +
                                " levels: the positions of the first are used");
    }
    group.fields = std::move(fields);
    if (is_position) {
      group.names.standard_name = name == east_of_cells ? "longitude" : "latitude";
      group.names.units = name == east_of_cells ? "degrees_east" : "degrees_north";
    } else if (group.names.units == "m") {
      group.names.standard_name = "altitude";
    }
  }
}

std::vector<int> File::add_list(std::size_t g) {
  FileDimension list;
  list.name = g == 0 ? "ncells" : "ncells_" + std::to_string(g + 1);
  list.length = grids_[g].columns;
  list.is_list = true;
  list.grid_uuid = grids_[g].uuid;
  contents_.dimensions.push_back(std::move(list));
  return {static_cast<int>(contents_.dimensions.size()) - 1};
}

// Levels of type generalVertical 1 to n + 1 are the faces of the layers 1 to n.
void File::find_faces_of_layers() {
  const auto numbers_of = [&](const FileDimension& dimension) -> const std::vector<double>& {
    static const std::vector<double> none;
    const int v = cf::variable_named(contents_, dimension.name);
    return v < 0 ? none : held_[static_cast<std::size_t>(v)].numbers;
  };
  const std::string layers_name = "generalVerticalLayer";
  for (FileDimension& faces : contents_.dimensions) {
    if (!faces.name.starts_with("generalVertical") || faces.name.starts_with(layers_name)) continue;
    const std::vector<double>& levels = numbers_of(faces);
    for (std::size_t d = 0; d < contents_.dimensions.size(); ++d) {
      const FileDimension& layers = contents_.dimensions[d];
      const std::vector<double>& numbers = numbers_of(layers);
      if (layers.name.starts_with(layers_name) && levels.size() == numbers.size() + 1 &&
          std::equal(numbers.begin(), numbers.end(), levels.begin()) &&
          levels.back() == numbers.back() + 1) {
        faces.centers = static_cast<int>(d);
        faces.first_face = 0;
      }
    }
  }
}

}  // namespace windsplat::data::grib
