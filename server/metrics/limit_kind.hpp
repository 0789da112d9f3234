// The limits that can refuse a request, a connection or work, with their labels in metrics.
#pragma once

#include <array>

namespace windsplat::metrics {

// The limit that caused a refusal: a fixed set, with the labels used in metrics.
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
  waiting,     // queued work: pictures, loads, jobs
  arrivals,    // connections per second
  estimate,    // estimated time of a picture
  handshakes,  // processor time of TLS handshakes
};
inline constexpr std::array limit_names{
    "connections", "address_connections", "sessions", "address_sessions", "requests", "bytes",
    "render",      "failed_logins",       "pixels",   "kernels",          "waiting",  "arrivals",
    "estimate",    "handshakes"};

}  // namespace windsplat::metrics
