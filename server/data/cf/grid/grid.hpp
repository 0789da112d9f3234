// FileContents and dimension roles -> the grid to show, its variables, and the reasons why others
// are omitted.
#pragma once

#include <array>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/contents.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

// Limits on what is read: samples of a grid, of which boxes may be read, and samples of grids and
// meshes of which they are not.
inline constexpr std::size_t grid_samples_max = std::size_t{1} << 36;
inline constexpr std::size_t samples_max = std::size_t{1} << 31;

struct GridChoice {
  std::array<int, 3> space{-1, -1, -1};  // dimension ids of x, y, z; -1: missing dimension
  int time = -1;                         // dimension id, -1 if no field depends on time
  std::vector<int> variables;            // those shown, in the order of the file
  std::vector<LeftOut> left_out;
  std::string note;  // how to show other grids of the file; empty if there are none
};

// For each variable why it cannot be a field on any grid; empty if it can.
std::vector<std::string> reasons_of_no_field(const FileContents& contents,
                                             const std::vector<DimensionRole>& roles);

// Prefers the grid of a preferred variable, then grids with three spatial dimensions, then the one
// with the most samples over all its variables. Errors: bad_data if there is none, or if it exceeds
// grid_samples_max.
Result<GridChoice> choose_grid(const FileContents& contents,
                               const std::vector<DimensionRole>& roles);

}  // namespace windsplat::data::cf
