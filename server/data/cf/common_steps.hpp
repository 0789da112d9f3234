// Series that become one dataset -> the steps that all of them can have, where files are damaged.
#pragma once

#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/series.hpp"

namespace windsplat::data::cf {

// Leaves out of every series, with a note, the steps that one with damaged files lacks. Nothing is
// left out where no file is damaged or no step would remain. Errors: bad_data, naming the files, if
// some are damaged and steps are numbered, so that it is not known which of them belong together.
Result<void> keep_common_steps(const std::vector<SeriesFile*>& parts);

}  // namespace windsplat::data::cf
