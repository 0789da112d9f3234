// Series that become one dataset -> the steps that all of them can have, where files are damaged.
#pragma once

#include <vector>

#include "server/data/cf/series.hpp"

namespace windsplat::data::cf {

// Leaves out of every series, with a note, the steps that one with damaged files lacks. Nothing is
// left out where no file is damaged, steps are numbered or no step would remain.
void keep_common_steps(const std::vector<SeriesFile*>& parts);

}  // namespace windsplat::data::cf
