// Limits on the cost of one picture.
#pragma once

#include "server/access/limits.hpp"
#include "server/base/error.hpp"
#include "server/frame/cost.hpp"

namespace windsplat::access {

// Errors: too_large at /image, invalid at the dominant setting; both state the limit.
Result<void> check_cost(const frame::Cost& cost, const Limits& limits);

}  // namespace windsplat::access
