// The entries of dimensions that a user chooses behind the name of a file:
// "file.nc?number=3&band=2".
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data {

inline constexpr std::size_t selection_max = 16;

// One entry of a dimension: the value of its coordinate, or its index from 0 if it has none.
struct SelectedEntry {
  std::string dimension;
  std::string value;
};
using Selection = std::vector<SelectedEntry>;

// The position of the '?' before a selection: the last one, if a '=' and no '/' follow it. npos:
// none, as in a pattern.
std::size_t selection_mark(std::string_view path);

// Parses what follows the '?'. Errors: invalid, if a name or value is empty or a name is repeated,
// or for more than selection_max entries.
Result<Selection> parse_selection(std::string_view text);

// "number=3,band=2"; empty for an empty selection.
std::string selection_text(const Selection& selection);

}  // namespace windsplat::data
