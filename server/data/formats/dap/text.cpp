#include "server/data/formats/dap/text.hpp"

#include <algorithm>
#include <utility>

#include "server/base/ascii.hpp"

namespace windsplat::data::dap {

namespace {

constexpr std::string_view marks = "{}[];,=:";
constexpr std::string_view spaces = " \t\r\n";

int digit_of(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char small = static_cast<char>(c | 0x20);
  return small >= 'a' && small <= 'f' ? small - 'a' + 10 : -1;
}

// A name without its escapes (%20): DAP 2.0, 5.1. Those of control characters stay.
std::string unescaped(std::string_view name) {
  std::string out;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const int high = name[i] == '%' && i + 2 < name.size() ? digit_of(name[i + 1]) : -1;
    const int low = high < 0 ? -1 : digit_of(name[i + 2]);
    const int code = low < 0 ? 0 : high * 16 + low;
    if (code < ' ' || code == 0x7f) {
      out += name[i];
      continue;
    }
    out += static_cast<char>(code);
    i += 2;
  }
  return out;
}

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
  word_.text = word_.kind == Word::Kind::name ? unescaped(rest_.substr(0, size))
                                              : std::string(rest_.substr(0, size));
  rest_.remove_prefix(size);
}

}  // namespace windsplat::data::dap
