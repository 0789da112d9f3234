// Terrain-following levels: hybrid sigma-pressure and sigma coordinates (CF 1.8, appendix D).
// Vertical coordinate of a file -> p(level, column) = a(level) + b(level) * surface pressure.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/read_blocks.hpp"

namespace windsplat::data::cf {

// "a: hyam b: hybm p0: P0 ps: PS" -> names of variables by lower-case term.
std::map<std::string, std::string> formula_terms(const std::string& text);

// Whether a variable has one value for each column of the grid, at each step or for all.
bool on_columns(const FileContents& contents, const Placement& grid, int variable);

struct HybridLevels {
  std::vector<double> a;  // Pa, one per level, lowest first
  std::vector<double> b;  // factors of the surface pressure
  int surface = -1;       // variable of the surface pressure
  std::string units;      // units of the surface pressure
  double unit_pa = 1;
  std::vector<int> coefficients;  // variables of a and b
  std::string note;               // assumptions made
};

// Finds hybrid levels from formula_terms, otherwise from common names of coefficients (A_var, hyam,
// ...). coordinate: the vertical coordinate variable, -1 if there is none. Empty if the levels are
// of another kind or their surface pressure is not in the file. Errors: bad_data if a variable
// cannot be read.
Result<std::optional<HybridLevels>> find_hybrid(const ArrayFile& file, const Placement& grid,
                                                int coordinate);

struct LogarithmicLevels {
  std::vector<double> pressures;  // Pa, one per level, lowest first
  std::string note;               // assumptions made
};

// atmosphere_ln_pressure_coordinate: p = p0 exp(-lev). coordinate: as above. Empty if the levels
// are of another kind. Errors: bad_data if a variable cannot be read.
Result<std::optional<LogarithmicLevels>> find_logarithmic(const ArrayFile& file,
                                                          const Placement& grid, int coordinate);

// Identifies a surface pressure by standard name, otherwise by common names and units; of any
// dimensions.
bool is_surface_pressure(const FileVariable& variable);

// A surface pressure on the columns of the grid; -1 if there is none.
int find_surface_pressure(const FileContents& contents, const Placement& grid);

}  // namespace windsplat::data::cf
