// The limits that can refuse a request, a connection or work, and their names in metrics.
#pragma once

#include <array>

namespace windsplat::net {

// Which limit refused something: a fixed set, and the names that metrics have for them.
enum class LimitKind {
  connections,
  address_connections,
  sessions,
  address_sessions,
  requests,
  bytes,
  render,
  logins,
  pixels,
  kernels,
  waiting,     // work that waits: pictures, loads, jobs
  arrivals,    // connections a second
  estimate,    // time that a picture would take
  handshakes,  // processor time of TLS handshakes
};
inline constexpr std::array limit_names{
    "connections", "address_connections", "sessions", "address_sessions", "requests", "bytes",
    "render",      "failed_logins",       "pixels",   "kernels",          "waiting",  "arrivals",
    "estimate",    "handshakes"};

}  // namespace windsplat::net
