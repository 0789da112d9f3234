// Counts allocations of a program by operator new: linked in, it replaces the global one.
#pragma once

#include <cstdint>

namespace windsplat::bench {

struct Allocations {
  std::int64_t count = 0;      // since the start
  std::int64_t bytes = 0;      // since the start, as requested
  std::int64_t live = 0;       // now, as allocated by the heap
  std::int64_t live_peak = 0;  // since forget_peak()
};

Allocations allocations();
void forget_peak();

}  // namespace windsplat::bench
