// Maps requests to resources. Resources reply at once or, after a render job, later.
#pragma once

#include "server/api/services.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::api {

// Whether the path is answered under any load: /livez, /readyz, /metrics.
bool names_health(const http::Request& request);
// Whether the path is that of the stream.
bool names_stream(const http::Request& request);

// Calls `reply` once: now, or later from the renderer's thread. Does not throw after the reply.
// Returns the route name (routes.hpp).
const char* route(Services& services, const http::Request& request, const http::Reply& reply);

}  // namespace windsplat::api
