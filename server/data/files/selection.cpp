#include "server/data/files/selection.hpp"

#include <algorithm>
#include <utility>

namespace windsplat::data {

std::size_t selection_mark(std::string_view path) {
  const std::size_t mark = path.rfind('?');
  if (mark == std::string_view::npos || mark == 0) return std::string_view::npos;
  const std::string_view after = path.substr(mark);
  const bool selects =
      after.find('=') != std::string_view::npos && after.find('/') == std::string_view::npos;
  return selects ? mark : std::string_view::npos;
}

Result<Selection> parse_selection(std::string_view text) {
  const auto refused = [text](const std::string& why) {
    return make_error(ErrorKind::invalid,
                      in_quotes("?" + std::string(text)) + ' ' + why +
                          "; entries of dimensions are chosen by ?NAME=VALUE&NAME=VALUE");
  };
  Selection out;
  for (;;) {
    const std::size_t end = std::min(text.find('&'), text.size());
    const std::string_view one = text.substr(0, end);
    const std::size_t equals = std::min(one.find('='), one.size());
    if (equals == 0) return refused("has a choice without a name");
    if (equals + 1 >= one.size()) return refused("has a choice without a value");
    SelectedEntry entry{std::string(one.substr(0, equals)), std::string(one.substr(equals + 1))};
    const bool twice = std::any_of(out.begin(), out.end(), [&](const SelectedEntry& known) {
      return known.dimension == entry.dimension;
    });
    if (twice) return refused("chooses " + in_quotes(entry.dimension) + " twice");
    if (out.size() == selection_max) {
      return refused("has more than " + std::to_string(selection_max) + " choices");
    }
    out.push_back(std::move(entry));
    if (end == text.size()) return out;
    text.remove_prefix(end + 1);
  }
}

std::string selection_text(const Selection& selection) {
  std::string out;
  for (const SelectedEntry& one : selection) {
    out += (out.empty() ? "" : ",") + one.dimension + '=' + one.value;
  }
  return out;
}

}  // namespace windsplat::data
