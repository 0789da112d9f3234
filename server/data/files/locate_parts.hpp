// Shared by both ways to locate files: order of names, name of a series, formats with companion
// files, and the note on omitted links.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "server/data/files/files.hpp"

namespace windsplat::data {

inline constexpr std::size_t series_members_max = 100'000;

// Runs of digits compare as numbers: f2 before f10.
bool comes_before(std::string_view a, std::string_view b);
// The name without the wildcards of a pattern and without extension: "wrf_*.nc" is "wrf".
std::string stem_of_pattern(const std::string& pattern);
// Whether the file name belongs to a format whose header names companion files.
bool may_have_companions(const std::string& name);
// The same for the files of a series, each of which is a step: those of VTK.
bool steps_may_have_companions(const std::string& pattern);
// A note on the links that match the pattern of a series but are omitted: how many and why. Empty
// if there are none.
std::string links_left_out(const Location& series);

}  // namespace windsplat::data
