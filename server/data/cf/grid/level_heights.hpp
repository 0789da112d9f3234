// Heights of terrain-following levels: parametric vertical coordinates (CF 1.11, appendix D) whose
// values are heights, and heights that a file gives at every sample.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/read_blocks.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

// height(level, column) from coefficients of the level and values of the column.
struct ParametricLevels {
  using Constants = std::array<double, 4>;
  // Of the level, of the column (0 where the file has none), and the constant terms.
  using Formula = double (*)(const std::array<double, 3>& level,
                             const std::array<double, 2>& column, const Constants& constants);
  Formula formula = nullptr;
  std::vector<std::array<double, 3>> levels;  // lowest first
  std::array<int, 2> columns{-1, -1};         // variables; the second may depend on time
  const char* first_term = "";                // of the first in the formula: "orog", "depth", ...
  Constants constants{};
};

// Where the height of a sample comes from, in metres, upward.
struct LevelHeights {
  std::optional<ParametricLevels> parametric;
  int variable = -1;  // a variable of every sample, used if there is no formula
};

// Reads the columns' values at a step, then gives heights of samples.
class ParametricHeights {
 public:
  explicit ParametricHeights(const ParametricLevels& levels) : levels_(levels) {}
  // Errors: bad_data.
  Result<void> load(const ArrayFile& file, const Placement& grid, std::size_t step);
  // NaN where a value of the column is masked.
  [[nodiscard]] double at(std::size_t level, std::size_t column) const;

 private:
  const ParametricLevels& levels_;
  std::array<std::vector<float>, 2> columns_;
};

// Replaces a vertical axis without physical positions by the mean heights of its levels at the
// first step, and turns it if heights of every sample fall along it. coordinate: the vertical
// coordinate variable, -1 if there is none; variables: those on the grid. Empty if the heights are
// not in the file. Errors: bad_data.
Result<LevelHeights> find_heights(const ArrayFile& file, int coordinate,
                                  const std::vector<int>& variables, Placement& grid,
                                  DatasetInfo& info);

}  // namespace windsplat::data::cf
