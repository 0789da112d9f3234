// A violated property ends the process.
#include "tests/fuzz/support/check.hpp"

#include <cstdio>
#include <cstdlib>

#include "server/base/error.hpp"

namespace fuzz {

void expect(bool holds, std::string_view what, std::string_view seen) {
  if (holds) return;
  const std::string shown = windsplat::printable(seen, 2000);
  std::fprintf(stderr, "PROPERTY BROKEN: %.*s\n%s\n", static_cast<int>(what.size()), what.data(),
               shown.c_str());
  std::abort();
}

}  // namespace fuzz
