#include "server/base/nearest_word.hpp"

#include <algorithm>

#include "server/base/error.hpp"

namespace windsplat {
namespace {

constexpr std::size_t letters_max = 2;  // more distant words are unrelated
constexpr std::size_t word_bytes_max = 64;

}  // namespace

std::size_t letters_between(std::string_view one, std::string_view other) {
  std::vector<std::vector<std::size_t>> to(one.size() + 1,
                                           std::vector<std::size_t>(other.size() + 1));
  for (std::size_t i = 0; i <= one.size(); ++i) {
    for (std::size_t j = 0; j <= other.size(); ++j) {
      if (i == 0 || j == 0) {
        to[i][j] = i + j;
        continue;
      }
      const std::size_t changed = to[i - 1][j - 1] + (one[i - 1] == other[j - 1] ? 0 : 1);
      to[i][j] = std::min({changed, to[i - 1][j] + 1, to[i][j - 1] + 1});
      const bool swapped =
          i > 1 && j > 1 && one[i - 1] == other[j - 2] && one[i - 2] == other[j - 1];
      if (swapped) to[i][j] = std::min(to[i][j], to[i - 2][j - 2] + 1);
    }
  }
  return to.back().back();
}

std::string nearest_word(std::string_view word, const std::vector<std::string>& known) {
  if (word.size() > word_bytes_max) return {};
  std::string nearest;
  std::size_t least = letters_max + 1;
  for (const std::string& each : known) {
    const std::size_t letters = letters_between(word, each);
    if (letters >= least || 2 * letters >= word.size()) continue;
    least = letters;
    nearest = each;
  }
  return nearest;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& known) {
  const std::string nearest = nearest_word(word, known);
  return nearest.empty() ? nearest : "; did you mean " + in_quotes(nearest) + "?";
}

}  // namespace windsplat
