// Files whose longitude and latitude are 2-D: the coordinates tell which dimension runs east, which
// north, and where each column stands. File and choice in, a choice with its directions out.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/axes.hpp"
#include "server/data/cf/grid.hpp"
#include "server/data/cf/read_blocks.hpp"

namespace windsplat::data::cf {

struct Bearing {
  bool is_curvilinear = false;               // 2-D coordinates were found
  bool swapped = false;                      // the file's y dimension became x
  std::array<bool, 2> turned{false, false};  // x and y: the file's order runs west or south
  std::shared_ptr<const Columns> columns;    // turned likewise; null where some are missing
};

// Where x and y have no coordinates of their own and 2-D longitudes and latitudes lie on them:
// swaps choice.space[0] and [1] if longitude changes more along y than along x, and tells the
// directions. Errors: bad_data if the coordinates cannot be read.
Result<Bearing> find_bearing(const ArrayFile& file, const std::vector<DimensionRole>& roles,
                             GridChoice& choice);

// The same of a grid whose axes have coordinates of their own (metres of a projection, a rotated
// pole's degrees). Null where there are no 2-D longitudes and latitudes or some are missing.
Result<std::shared_ptr<const Columns>> find_columns(const ArrayFile& file, const Placement& grid);

// The variable that describes the map projection of one of those variables; -1 if there is none.
int grid_mapping_of(const ArrayFile& file, const std::vector<int>& variables);

// Longitudes and latitudes of a grid whose axes are degrees about a rotated pole (CF 1.8, appendix
// F); mapping: the variable that tells the pole. Null if it does not.
std::shared_ptr<const Columns> columns_about_pole(const ArrayFile& file, int mapping,
                                                  const Grid& grid);

}  // namespace windsplat::data::cf
