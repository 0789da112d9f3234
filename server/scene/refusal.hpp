// How a view is refused: an error at a JSON pointer, and what the user said in quotes.
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
