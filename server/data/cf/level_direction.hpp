// Which way an auxiliary coordinate of levels counts: heights upward, depths downward.
#pragma once

#include <string>

#include "server/data/cf/contents.hpp"

namespace windsplat::data::cf {

// By the standard name alone. 1: heights, -1: depths, 0: neither.
int direction_of_name(const std::string& standard_name);

// By `positive`, the standard name, otherwise name and description; 0 also for thicknesses and
// bounds.
int direction_of_levels(const FileVariable& variable);

}  // namespace windsplat::data::cf
