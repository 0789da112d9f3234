// How many workers the limits of memory and of open files permit, and how much each reads at once.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "server/base/error.hpp"
#include "server/convert/plan.hpp"

namespace windsplat::convert {

struct Shares {
  unsigned workers = 1;
  std::uint64_t loader_bytes = 0;   // of each
  std::array<int, 2> across{0, 0};  // pencils of a read, see readings()
  double decoded = 1;               // how often a sample is decoded, of the worst field
  std::string decoded_field;
};

// Errors: out_of_memory, if not even one worker fits, with the limit that would.
Result<Shares> share_memory(const data::DatasetInfo& info, const Plan& plan,
                            const Options& options);

}  // namespace windsplat::convert
