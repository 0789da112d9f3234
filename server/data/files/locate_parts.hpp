// What the two ways of locating files share: order of names, what a series is called, which
// formats name files beside them, what of a series is left out.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "server/data/files/files.hpp"

namespace windsplat::data {

inline constexpr std::size_t series_members_max = 100'000;

// Runs of digits compare as numbers: f2 before f10.
bool comes_before(std::string_view a, std::string_view b);
// The name without what a pattern leaves open and without its extension: "wrf_*.nc" is "wrf".
std::string stem_of_pattern(const std::string& pattern);
bool has_wildcard(std::string_view name);
// Whether the file name belongs to a format whose header names companion files.
bool may_have_companions(const std::string& name);
// Of links that a series' pattern matches and that are none of its files: a note that says how many
// and why. Empty where there are none.
std::string links_left_out(const Location& series);

}  // namespace windsplat::data
