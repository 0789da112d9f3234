// A generated family of datasets, with structure at every scale, that nothing is calibrated on.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "server/data/resident/dataset.hpp"

namespace windsplat::test {

// A vector field "flow" in m/s and a scalar field "cloud" in 0 to 1, on a box in metres.
struct TrialField {
  std::string name;
  std::array<int, 3> dims;
  std::array<double, 3> extent_m;
};

// The family: noise, turbulence, vortices, shear layers, shells, fronts, a plume, masked samples;
// on cubes, shallow boxes and columns.
const std::vector<TrialField>& trial_fields();

// The dataset of a member of the family. `name` is one of trial_fields().
std::unique_ptr<data::Dataset> trial_dataset(const TrialField& field);

}  // namespace windsplat::test
