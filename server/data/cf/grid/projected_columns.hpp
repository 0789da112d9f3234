// Coordinates of a map projection -> longitudes and latitudes of the columns, by PROJ.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/fields/rotation.hpp"
#include "server/data/cf/grid/projection.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

struct ProjectedColumns {
  std::shared_ptr<const Columns> columns;
  // Columns that do not lie on the Earth, as those beside the disc of a satellite's picture; empty
  // if all do. Each has a position just inside the edge of the map, in its direction from the
  // origin.
  std::vector<bool> outside;
  std::size_t outside_count = 0;
};

// x, y: metres, or degrees of a rotated pole; at most 2^24 columns, x fastest. Errors: bad_data
// with the reason as a predicate: PROJ rejects the parameters, coordinates are out of all
// proportion, or no column lies on the Earth.
Result<ProjectedColumns> project_columns(const Projection& projection, const std::vector<double>& x,
                                         const std::vector<double>& y);

// The directions of the axes at the columns that project_columns() gives, by steps far shorter than
// a cell, since neighbours are no guide at the edge of a map: there cells are stretched without
// bound. Zero for columns outside. Errors: as above.
Result<AxisTangents> tangents_on_map(const Projection& projection, const std::vector<double>& x,
                                     const std::vector<double>& y, const ProjectedColumns& columns);

// The coordinates of a place, in metres. Errors: as above.
Result<std::array<double, 2>> project_place(const Projection& projection, double longitude,
                                            double latitude);

}  // namespace windsplat::data::cf
