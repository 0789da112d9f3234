// A generated family of datasets, with structure at every scale, that nothing is calibrated on.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
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
  bool terrain = false;  // has a third field, "height" in m
};

// Vector and scalar at a sample. `at`: position in [0, 1] along each axis; `index`: its indices.
using Point = std::array<double, 3>;
struct Values {
  std::array<double, 3> flow{};
  double cloud = 0;
  double height = 0;
};
using TrialFormula = std::function<Values(const Point& at, const std::array<int, 3>& index)>;

// Uniform in [-1, 1).
double hashed(int i, int j, int k, std::uint32_t salt);
// Trilinear interpolation of hashed values on a lattice of `cells` cells along each axis.
double noise(const Point& at, int cells, std::uint32_t salt);
// Octaves of 2, 4, ... `finest` cells whose amplitude falls by `decay` each.
double turbulence(const Point& at, int finest, double decay, std::uint32_t salt);

// The family: noise, turbulence, vortices, shear layers, shells, fronts, a plume, masked samples;
// on cubes, shallow boxes and columns.
const std::vector<TrialField>& trial_fields();

// The dataset of a member of the family. `name` is one of trial_fields().
std::unique_ptr<data::Dataset> trial_dataset(const TrialField& field);

// The dataset of any formula; the name of `field` is its id.
std::unique_ptr<data::Dataset> formula_dataset(const TrialField& field, TrialFormula formula);

}  // namespace windsplat::test
