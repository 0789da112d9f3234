// Longitudes and latitudes of the columns of a grid whose axes have 1-D coordinates.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/fields/rotation.hpp"
#include "server/data/cf/read_blocks.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

struct Positions {
  std::shared_ptr<const Columns> columns;  // null if they lie along the axes, or are unknown
  std::vector<bool> outside;               // as in ProjectedColumns
  bool follow_other_axes = false;          // rows and columns do not run east and north
  // The directions of the axes of a map with an edge; null: as neighbours tell.
  std::function<Result<AxisTangents>()> tangents;
};

// Precedence: 2-D longitudes and latitudes of the file, then the map projection of its grid
// mapping. variables: those on the grid; axes: the coordinate variables of x and y, -1 if there are
// none. Appends notes to `info`, and shifts longitudes that are not relative to Greenwich. A
// projection that cannot be computed is noted, with the reason. Errors: bad_data if coordinates
// cannot be read.
Result<Positions> find_positions(const ArrayFile& file, const std::vector<int>& variables,
                                 const std::array<int, 2>& axes, const Placement& placement,
                                 DatasetInfo& info);

}  // namespace windsplat::data::cf
