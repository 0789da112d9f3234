#include "server/data/formats/dap/text.hpp"

#include <algorithm>
#include <utility>

#include "server/base/ascii.hpp"

namespace windsplat::data::dap {

namespace {

constexpr std::string_view marks = "{}[];,=:";
constexpr std::string_view spaces = " \t\r\n";

}  // namespace

bool Word::is_name(std::string_view name) const {
  return kind == Kind::name && lower(text) == name;
}

Word Words::take() {
  Word out = std::exchange(word_, Word());
  next();
  return out;
}

bool Words::take(char mark) {
  if (!word_.is(mark)) return false;
  next();
  return true;
}

bool Words::skip() {
  int depth = 0;
  while (word_.kind != Word::Kind::none) {
    const Word word = take();
    if (word.is('{') && ++depth > depth_max) return false;
    if (word.is('}') && --depth <= 0) {
      take(';');
      return depth == 0;
    }
    if (word.is(';') && depth == 0) return true;
  }
  return false;
}

void Words::next() {
  word_ = {};
  for (;;) {
    const std::size_t begin = rest_.find_first_not_of(spaces);
    if (begin == std::string_view::npos) {
      rest_ = {};
      return;
    }
    rest_.remove_prefix(begin);
    if (rest_.front() != '#') break;
    rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
  }
  if (rest_.front() == '"') {
    word_.kind = Word::Kind::quoted;
    std::size_t at = 1;
    for (; at < rest_.size() && rest_[at] != '"'; ++at) {
      if (rest_[at] == '\\' && at + 1 < rest_.size()) ++at;
      word_.text += rest_[at];
    }
    if (at >= rest_.size()) word_ = {};  // without an end
    rest_.remove_prefix(std::min(at + 1, rest_.size()));
    return;
  }
  std::size_t size = 1;
  word_.kind = Word::Kind::mark;
  if (marks.find(rest_.front()) == std::string_view::npos) {
    word_.kind = Word::Kind::name;
    const std::size_t end = rest_.find_first_of("{}[];,=\" \t\r\n");
    size = end == std::string_view::npos ? rest_.size() : end;
  }
  word_.text = rest_.substr(0, size);
  rest_.remove_prefix(size);
}

}  // namespace windsplat::data::dap
