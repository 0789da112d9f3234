// Curvilinear grids: 2-D longitudes and latitudes give the direction of each dimension and the
// position of each column. File and choice in, choice with directions out.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
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
  std::array<bool, 2> turned{false, false};  // x and y: the file is ordered westward or southward
  std::shared_ptr<const Columns> columns;    // in the order of volumes; null if some are missing
};

// For 2-D longitudes and latitudes, where x and y have no coordinates of their own: swaps
// choice.space[0] and [1] if longitude changes more along y than along x, and returns the
// directions. Errors: bad_data if the coordinates cannot be read.
Result<Bearing> find_bearing(const ArrayFile& file, const std::vector<DimensionRole>& roles,
                             GridChoice& choice);

// Removes 2-D positions that place the rows and columns of a choice from what is left out, and its
// dimensions, which are not placed by index.
void forget_positions(const ArrayFile& file, const std::vector<DimensionRole>& roles,
                      const GridChoice& choice, std::vector<LeftOut>& left_out);

// The columns of a grid whose axes have 1-D coordinates (metres of a projection, degrees of a
// rotated pole). Null if 2-D longitudes or latitudes are absent or incomplete.
Result<std::shared_ptr<const Columns>> find_columns(const ArrayFile& file, const Placement& grid);

// The 2-D longitude or latitude variable on exactly these two dimensions; -1 if there is none.
int position_on(const FileContents& contents, int a, int b, bool longitude);

// The grid mapping variable of one of `variables`; -1 if there is none. coordinate: the variable of
// the x axis, which tells several mappings of a variable apart ("crs: x y wgs84: lat lon").
int grid_mapping_of(const ArrayFile& file, const std::vector<int>& variables,
                    const std::string& coordinate);

// Makes longitudes continuous, along the first column and then along every row of `width`.
void unwrap_longitudes(std::vector<double>& longitude, std::size_t width);

}  // namespace windsplat::data::cf
