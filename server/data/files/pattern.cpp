#include "server/data/files/pattern.hpp"

#include <fnmatch.h>

namespace windsplat::data {

std::vector<std::string> alternatives_of(std::string_view pattern) {
  const std::size_t open = pattern.find('{');
  const std::size_t close = open == std::string_view::npos ? open : pattern.find('}', open);
  if (close == std::string_view::npos ||
      pattern.substr(open, close - open).find(',') == std::string_view::npos) {
    return {std::string(pattern)};
  }
  const std::string before(pattern.substr(0, open));
  const std::string_view after = pattern.substr(close + 1);
  std::string_view list = pattern.substr(open + 1, close - open - 1);
  std::vector<std::string> out;
  for (;;) {
    const std::size_t comma = list.find(',');
    out.push_back(before + std::string(list.substr(0, comma)) + std::string(after));
    if (comma == std::string_view::npos) return out;
    list.remove_prefix(comma + 1);
  }
}

bool has_wildcard(std::string_view name) {
  return name.find_first_of("*?[") != std::string_view::npos || alternatives_of(name).size() > 1;
}

int alternative_matching(const std::vector<std::string>& alternatives, const std::string& name) {
  for (std::size_t n = 0; n < alternatives.size(); ++n) {
    if (::fnmatch(alternatives[n].c_str(), name.c_str(), FNM_PERIOD) == 0) {
      return static_cast<int>(n);
    }
  }
  return -1;
}

}  // namespace windsplat::data
