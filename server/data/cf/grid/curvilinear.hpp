// Curvilinear grids: 2-D longitudes and latitudes give the direction of each dimension and the
// position of each column. File and choice in, choice with directions out.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/grid/grid.hpp"
#include "server/data/cf/read_blocks.hpp"

namespace windsplat::data::cf {

struct Bearing {
  bool is_curvilinear = false;               // 2-D coordinates were found
  bool swapped = false;                      // the file's y dimension became x
  std::array<bool, 2> turned{false, false};  // x and y: the file's order runs west or south
  std::shared_ptr<const Columns> columns;    // turned likewise; null where some are missing
};

// For 2-D longitudes and latitudes, where x and y have no coordinates of their own: swaps
// choice.space[0] and [1] if longitude changes more along y than along x, and returns the
// directions. Errors: bad_data if the coordinates cannot be read.
Result<Bearing> find_bearing(const ArrayFile& file, const std::vector<DimensionRole>& roles,
                             GridChoice& choice);

// The same of a grid whose axes have coordinates of their own (metres of a projection, a rotated
// pole's degrees). Null where there are no 2-D longitudes and latitudes or some are missing.
Result<std::shared_ptr<const Columns>> find_columns(const ArrayFile& file, const Placement& grid);

// The variable that describes the map projection of one of those variables; -1 if there is none.
int grid_mapping_of(const ArrayFile& file, const std::vector<int>& variables);

// Longitudes and latitudes of a grid whose axes are degrees about a rotated pole (CF 1.8, appendix
// F); mapping: the variable with the pole's position. Null if it has none.
std::shared_ptr<const Columns> columns_about_pole(const ArrayFile& file, int mapping,
                                                  const Grid& grid);

}  // namespace windsplat::data::cf
