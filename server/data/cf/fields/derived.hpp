// Fields derived from variables of a file: pressure, heights, vertical velocity in metres per
// second. Listed on opening, computed on demand.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/fields/fields.hpp"
#include "server/data/cf/grid/level_heights.hpp"
#include "server/data/cf/grid/level_pressures.hpp"
#include "server/data/cf/read_blocks.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data::cf {

struct DerivedField {
  enum class Rule {
    pressure,         // pressure of every sample, in the units of the surface pressure
    height,           // inputs[0] times scale, in metres
    level_height,     // height of the parametric level, in metres
    standard_height,  // height of the pressure of the sample in the standard atmosphere
    rise,             // inputs: u, v, omega: w = -omega R T / (p g) as the third component
  };
  Rule rule = Rule::pressure;
  FieldInfo info;
  std::vector<int> inputs;      // indices of variables
  std::vector<double> factors;  // of u and v for rise, to m/s
  double scale = 1;             // factor to metres for height (inputs[0]), to Pa/s for rise (omega)
  int temperature = -1;         // temperature variable; -1: standard atmosphere
  double celsius = 0;           // added to temperatures
};

// plans: the fields of the file; variables: those on the grid. Adds notes of the assumptions.
// Errors: bad_data if a variable that must be examined cannot be read.
Result<std::vector<DerivedField>> find_derived(const ArrayFile& file, const Placement& grid,
                                               const std::vector<FieldPlan>& plans,
                                               const std::vector<int>& variables,
                                               const PressureLevels& pressures,
                                               const LevelHeights& heights,
                                               std::vector<std::string>& notes);

// The field at a step, all components. Errors: bad_data.
Result<void> fill_derived(const ArrayFile& file, const Placement& grid,
                          const PressureLevels& pressures, const LevelHeights& heights,
                          const DerivedField& field, std::size_t step, float* out,
                          const Progress& tell);

}  // namespace windsplat::data::cf
