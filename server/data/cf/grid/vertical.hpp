// Levels that follow the ground: hybrid sigma-pressure and sigma coordinates (CF 1.8, appendix D).
// A file's vertical coordinate -> p(level, column) = a(level) + b(level) * surface pressure.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/read_blocks.hpp"

namespace windsplat::data::cf {

struct HybridLevels {
  std::vector<double> a;  // Pa, one a level, from below
  std::vector<double> b;  // of the surface pressure
  int surface = -1;       // the variable of the surface pressure
  std::string units;      // its
  double unit_pa = 1;
  std::vector<int> coefficients;  // variables that a and b come from
  std::string note;               // what was taken for what
};

// From formula_terms, else from the names that models give their coefficients (A_var, hyam, ...).
// coordinate: the vertical coordinate variable, -1 if there is none. Empty where the levels are not
// of this kind or their surface pressure is not in the file. Errors: bad_data if what is there
// cannot be read.
Result<std::optional<HybridLevels>> find_hybrid(const ArrayFile& file, const Placement& grid,
                                                int coordinate);

// By standard name, else by the names and units that models give it; of whatever dimensions.
bool is_surface_pressure(const FileVariable& variable);

// A surface pressure on the grid's columns; -1 if there is none.
int find_surface_pressure(const FileContents& contents, const Placement& grid);

}  // namespace windsplat::data::cf
