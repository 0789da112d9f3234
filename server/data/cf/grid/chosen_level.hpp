// The place of a grid whose level or latitude was chosen by the user.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/grid/grid.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

struct ChosenLevel {
  std::string name;  // as in FileVariable::level
  Axis axis;         // with one coordinate
  std::string note;  // names the fields that lie elsewhere; empty if none does
};

// The level of the variable that the user named, otherwise of the first of `shown` that had one;
// nullopt if none had. horizontal: the kind of the grid's x axis.
Result<std::optional<ChosenLevel>> find_chosen_level(const ArrayFile& file,
                                                     const std::vector<int>& shown,
                                                     AxisKind horizontal);

// The axis of one latitude along which a section of longitudes runs: a coordinate without
// dimensions that was chosen or that one of `shown` names in `coordinates`; nullopt if there is
// none, or several that differ.
Result<std::optional<Axis>> find_chosen_latitude(const ArrayFile& file,
                                                 const std::vector<int>& shown);

}  // namespace windsplat::data::cf
