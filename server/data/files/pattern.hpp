// Patterns of file names: * ? [...], and once a list in braces, whose alternatives hold different
// variables of one dataset.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace windsplat::data {

// "{ua,va}_*.nc" -> "ua_*.nc", "va_*.nc"; the pattern itself if it has no braces with a comma.
std::vector<std::string> alternatives_of(std::string_view pattern);

bool has_wildcard(std::string_view name);

// The first alternative that matches a name, as fnmatch(3) with FNM_PERIOD; -1: none does.
int alternative_matching(const std::vector<std::string>& alternatives, const std::string& name);

}  // namespace windsplat::data
