// Request -> the resource it names. Resources answer at once or, after a job of the renderer,
// later.
#pragma once

#include "server/api/services.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::net {

// Whether the path is one that is answered however much there is to do: /livez, /readyz, /metrics.
bool names_health(const Request& request);
// Whether the path is the stream's.
bool names_stream(const Request& request);

// Calls `reply` once: now, or later from the renderer's thread. Never throws past a reply. The
// value is the resource's name (routes.hpp).
const char* route(Services& services, const Request& request, const Reply& reply);

}  // namespace windsplat::net
