#include "server/http/rate_limit.hpp"

#include <string>

namespace windsplat::http {

void add_rate_limits(Response& response, const std::vector<RateLimit>& limits) {
  if (limits.empty()) return;
  std::string policies;
  std::string left;
  for (const RateLimit& limit : limits) {
    const std::string name = std::string(policies.empty() ? "" : ", ") + '"' + limit.name + '"';
    policies += name + ";q=" + std::to_string(limit.quota) + ";w=" + std::to_string(limit.window_s);
    if (*limit.unit != '\0') policies += std::string(";qu=\"") + limit.unit + '"';
    left +=
        name + ";r=" + std::to_string(limit.remaining) + ";t=" + std::to_string(limit.full_in_s);
  }
  response.headers.emplace_back("RateLimit-Policy", policies);
  response.headers.emplace_back("RateLimit", left);
}

}  // namespace windsplat::http
