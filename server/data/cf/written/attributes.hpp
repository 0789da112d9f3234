// Metadata of a dataset -> variables and attributes of a file of the CF conventions, as netCDF
// files and Zarr stores have them.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

// Names and texts, none of them empty, in the order of the file.
using WrittenAttributes = std::vector<std::pair<std::string, std::string>>;

// An array that is written: a component of a field.
struct WrittenVariable {
  std::string name;           // FieldInfo::components
  std::size_t field = 0;      // index of the field whose volume contains it
  std::size_t component = 0;  // index of its array within that volume
};

// Every variable of the fields that are not derived, once: components of vectors, then the
// remaining scalars.
std::vector<WrittenVariable> written_variables(const DatasetInfo& info);

// Of the file, or of a group that is opened as one: Conventions, title, source.
WrittenAttributes dataset_attributes(const DatasetInfo& info);

// False: the dataset has a single step without a time, and its variables no such dimension.
bool has_times(const DatasetInfo& info);
WrittenAttributes time_attributes(const DatasetInfo& info);

// Of axis x, y, z: 0, 1, 2.
std::string axis_name(const DatasetInfo& info, std::size_t which);
WrittenAttributes axis_attributes(const Axis& axis, std::size_t which);

// Of the positions of columns (Grid::columns), variables (y, x) in degrees, and of the ground.
// Names of the two: longitude and latitude, followed by "_of_columns" where an axis or a field has
// that name.
std::array<std::string, 2> position_names(const DatasetInfo& info);
WrittenAttributes longitude_attributes();
WrittenAttributes latitude_attributes();
// Of heights as Ground has them, on land, or of their opposites, the depths of a sea floor.
WrittenAttributes ground_attributes(const Ground& ground);

// units, standard_name, long_name or windsplat_vector, which names the vector and the component.
WrittenAttributes variable_attributes(const DatasetInfo& info, const WrittenVariable& variable);
// Those, and `coordinates` if the dataset has columns; stores have them.
WrittenAttributes placed_attributes(const DatasetInfo& info, const WrittenVariable& variable);
// Of the mean over groups of samples of a variable, or of a vector's magnitude: cell_methods.
WrittenAttributes mean_attributes(const DatasetInfo& info, const WrittenVariable& variable);

}  // namespace windsplat::data::cf
