// What files of known models do not state: names of WRF's and ROMS' velocities, and variables that
// WRF stores as perturbations and base states (WRF-ARW version 4, user's guide, chapter 5).
#pragma once

#include <vector>

#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

// A variable computed from others with the same dimensions.
struct ComputedVariable {
  FileVariable variable;
  std::vector<int> inputs;  // unpacked values of these variables, NaN where masked
  double (*value)(const double* inputs) = nullptr;
};

// pressure (P + PB, Pa), air_temperature (from T + 300 K, the potential temperature) and height
// ((PH + PHB) / g, m) at the centers of cells. Empty if the variables of a file are not WRF's.
// contents: with variables at the centers.
std::vector<ComputedVariable> variables_of_wrf(const FileContents& contents);

// Sets the standard names that files of WRF and ROMS may lack, by which U, V and W become a vector
// along the rows and columns of the grid.
void name_velocities(FileContents& contents);

}  // namespace windsplat::data::cf
