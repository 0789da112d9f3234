#include "server/data/cf/grid/plane_spacing.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/cf/grid/vertical.hpp"
#include "server/data/cf/time.hpp"

namespace windsplat::data::cf {

namespace {

constexpr double factor_tolerance = 1e-3;

// The largest difference of a map factor from 1 at the first step; 0 if the file has none.
Result<double> map_distortion(const ArrayFile& file, const Placement& grid) {
  const int v = variable_named(file.contents(), "MAPFAC_M");
  if (v < 0 || !on_columns(file.contents(), grid, v)) return 0.0;
  if (auto fine = file.charge(v, decoded_step_bytes(file, grid, v, {0, 1})); !fine) {
    return fine.error();
  }
  std::vector<float> factors(grid.layer());
  auto read = read_variable(file, grid, v, 0, {0, 1}, factors.data(), [](double) {});
  if (!read) return read.error();
  double most = 0;
  for (const float factor : factors) {
    const double off = std::abs(static_cast<double>(factor) - 1);
    most = std::isnan(off) ? most : std::max(most, off);
  }
  return most;
}

}  // namespace

Result<void> place_in_plane(const ArrayFile& file, const Placement& grid,
                            const std::array<int, 2>& coordinates, DatasetInfo& info) {
  std::array<double, 2> spacing{0, 0};
  for (std::size_t a = 0; a < 2; ++a) {
    if (info.grid.columns || grid.space.at(a) < 0 || coordinates.at(a) >= 0) return {};
    spacing.at(a) = file.contents().dimensions.at(at(grid.space.at(a))).spacing_m;
    if (!(spacing.at(a) > 0)) return {};
  }
  const auto distortion = map_distortion(file, grid);
  if (!distortion) return distortion.error();
  if (*distortion > factor_tolerance) {
    info.notes.push_back("'MAPFAC_M' differs from 1 by up to " + number_text(*distortion) +
                         ": the grid is not placed by DX and DY");
    return {};
  }
  for (std::size_t a = 0; a < 2; ++a) {
    Axis& axis = info.grid.axes.at(a);
    for (double& place : axis.coordinates) place *= spacing.at(a);
    axis.units = "m";
    info.left_out.erase(std::remove_if(info.left_out.begin(), info.left_out.end(),
                                       [&](const LeftOut& left) { return left.name == axis.name; }),
                        info.left_out.end());
  }
  info.notes.push_back("the grid is placed by DX = " + number_text(spacing[0]) +
                       " m and DY = " + number_text(spacing[1]) + " m of the file");
  return {};
}

}  // namespace windsplat::data::cf
