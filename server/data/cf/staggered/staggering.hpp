// Staggered grids (Arakawa B and C): which dimensions of a file number the faces or corners of
// cells whose centers another dimension numbers.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

struct Stagger {
  int centers = -1;          // dimension of the centers; -1: the dimension is not staggered
  bool aligned = false;      // sample i lies at center i: the dimension only has another name
  std::ptrdiff_t first = 0;  // otherwise center i lies between samples i + first and i + first + 1
  std::vector<double> upper =
      {};  // weights of the latter at each center, NaN: masked; empty: all 1/2
};

// One entry per dimension of the file. Evidence in this order: what the reader
// knows (FileDimension::centers), SGRID metadata (sgrid.github.io,
// version 0.3: cf_role = grid_topology), names of dimensions of WRF, ROMS and PALM, 1-D coordinates
// of which each lies amid two of another dimension, or horizontal ones that equal those of another;
// of the Unified Model's levels their heights, with the weights of linear interpolation.
// Errors: bad_data if coordinates cannot be read.
Result<std::vector<Stagger>> find_staggering(const ArrayFile& file);

}  // namespace windsplat::data::cf
