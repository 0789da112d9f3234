// Variables at different heights on one dimension of levels.
#pragma once

#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/staggered/staggering.hpp"

namespace windsplat::data::cf {

// One entry per variable of the file in both.
struct SharedLevels {
  std::vector<Stagger> staggers;
  std::vector<std::string> unread;  // why a variable cannot be placed; empty if it can
};

// Winds of the Unified Model may share the dimension of the levels of other variables, since these
// have the same numbers, and lie between them by the heights (level_height) that their
// `coordinates` name. On dimensions whose coordinate only numbers the levels, variables at other
// heights than those that most variables name are staggered along the dimension, with the weights
// of linear interpolation in height, if their heights lie between those; otherwise they cannot be
// read, nor can those that name no heights, or several that differ. Errors: bad_data.
Result<SharedLevels> find_shared_levels(const ArrayFile& file);

}  // namespace windsplat::data::cf
