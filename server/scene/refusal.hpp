// Errors of invalid views: the JSON pointer and quoted user input.
#pragma once

#include <string>
#include <utility>

#include "server/base/error.hpp"

namespace windsplat::scene {

inline Error invalid_at(std::string pointer, std::string detail) {
  return make_error_at(ErrorKind::invalid, std::move(pointer), std::move(detail));
}

// Printable, in double quotes.
inline std::string in_double_quotes(const std::string& text) {
  std::string out(1, '"');
  out += printable(text);
  out += '"';
  return out;
}

}  // namespace windsplat::scene
