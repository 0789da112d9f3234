// The headers RateLimit and RateLimit-Policy (draft-ietf-httpapi-ratelimit-headers-10): what a
// client may still send.
#pragma once

#include <cstdint>
#include <vector>

#include "server/http/exchange.hpp"

namespace windsplat::http {

// A quota of a client and what is left of it.
struct RateLimit {
  const char* name = "";  // of the policy: a structured-field string without quotes
  std::int64_t quota = 0;
  std::int64_t window_s = 0;   // the whole quota comes back in this time
  std::int64_t remaining = 0;  // of the quota, now
  std::int64_t full_in_s = 0;  // time until nothing of it is used
  const char* unit = "";       // of the quota; empty: requests
};

// Adds both headers, with one member for each limit; nothing without limits.
void add_rate_limits(Response& response, const std::vector<RateLimit>& limits);

}  // namespace windsplat::http
