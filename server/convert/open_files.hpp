// How many files workers may have open.
#pragma once

#include "server/convert/plan.hpp"

namespace windsplat::convert {

// The number of workers, at most `workers` and at least 1, for whose files the limit of this
// process suffices (RLIMIT_NOFILE), which is raised for them as far as it may be.
unsigned workers_with_files(const Plan& plan, unsigned workers);

}  // namespace windsplat::convert
