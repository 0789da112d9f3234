// Suggestions for misspelt words.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace windsplat {

// Edit distance of two words: letters changed, added, removed or swapped with a neighbour (optimal
// string alignment; Damerau 1964).
std::size_t letters_between(std::string_view one, std::string_view other);

// The known word with the fewest letters between, at most two, and less than half of the word.
// Empty: none.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

// "; did you mean 'X'?" or nothing.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

}  // namespace windsplat
