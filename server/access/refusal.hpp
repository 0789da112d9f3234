// What a limit refuses.
#pragma once

#include "server/metrics/limit_kind.hpp"

namespace windsplat::access {

struct Refusal {
  metrics::LimitKind kind = metrics::LimitKind::connections;
  double limit = 0;       // limit as in Limits
  int retry_after_s = 1;  // estimated time until admission
};

}  // namespace windsplat::access
