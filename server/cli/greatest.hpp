// Where fields of a dataset are greatest, as text.
#pragma once

#include <string>
#include <vector>

#include "server/data/resident/dataset.hpp"

namespace windsplat::cli {

// A line for each field of the file: its greatest value, of vectors the magnitude, with the
// coordinates of the sample and the step, of the first `steps` steps. Only from what is in memory:
// fields of which a step is absent, or all samples are masked, have none.
std::vector<std::string> greatest_values(const data::Dataset& dataset, std::size_t steps);

}  // namespace windsplat::cli
