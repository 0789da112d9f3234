// Files whose longitude and latitude are 2-D: the coordinates tell which dimension runs east, which
// north, and where each column stands. File and choice in, a choice with its directions out.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf_axes.hpp"
#include "server/data/cf_grid.hpp"
#include "server/data/netcdf_file.hpp"

namespace windsplat::data::cf {

struct Bearing {
  bool is_curvilinear = false;               // 2-D coordinates were found
  std::array<bool, 2> turned{false, false};  // x and y: the file's order runs west or south
  std::shared_ptr<const Columns> columns;    // turned likewise; null where some are missing
};

// Where x and y have no coordinates of their own and 2-D longitudes and latitudes lie on them:
// swaps choice.space[0] and [1] if longitude changes more along y than along x, and tells the
// directions. Errors: bad_data if the coordinates cannot be read.
Result<Bearing> find_bearing(const netcdf::File& file, const std::vector<DimensionRole>& roles,
                             GridChoice& choice);

}  // namespace windsplat::data::cf
