// WINDSPLAT_CHECK: an invariant whose violation is a bug. Throws, so that a session can close while
// the daemon continues.
#pragma once

#include <stdexcept>
#include <string>

namespace windsplat {

[[noreturn]] inline void check_failed(const char* expression, const char* file, int line) {
  throw std::logic_error(std::string(file) + ":" + std::to_string(line) +
                         ": CHECK failed: " + expression);
}

}  // namespace windsplat

#define WINDSPLAT_CHECK(expression) \
  ((expression) ? (void)0 : ::windsplat::check_failed(#expression, __FILE_NAME__, __LINE__))
