// Limits per client address and in total. 0 means no limit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/limits.hpp"

namespace windsplat::access {

// An address is an IPv4 address or an IPv6 network of 64 bits (address.hpp). The defaults are above
// the usage of many people behind one address; docs/user/configuration.md describes the effect of
// each.
struct Limits {
  std::size_t connections = 512;
  std::size_t connections_per_address = 256;
  // New connections per second, in bursts of ten seconds' worth; one over TLS counts as
  // five. The total limit refuses only addresses with more than a second's worth
  // recently.
  double arrivals = 2000;
  double arrivals_per_address = 500;
  // Processor time of TLS handshakes in milliseconds per second, in bursts of ten seconds' worth; a
  // handshake in progress may exceed it. The total applies to addresses that have not shown the
  // token recently, and again to those that have; 127.0.0.1 and ::1 have only the limit per
  // address.
  double handshake_ms = 250;
  double handshake_ms_per_address = 100;
  std::size_t sessions_per_address = 48;  // total: ServerOptions::sessions_max
  double requests_per_address = 1000;     // per second; bursts of ten seconds' worth
  double messages_per_address = 4000;     // stream messages per second
  double received_per_address = 8e6;      // bytes of those messages per second
  double bytes_per_address = 0;           // sent per second; the last response may exceed it
  double render_s_per_address = 0;        // render time per minute; the last one may exceed it
  double failed_logins_per_address = 30;  // per minute
  std::int64_t pixels = protocol::limits::image_pixels_max;  // maximum of a picture
  double kernels = 1e10;                                     // maximum of a picture
                                                             // (frame/cost.hpp)
  double render_s = 120;  // estimated time of a picture requested over HTTP
  // Limit in milliseconds on how long requests of other addresses may delay a picture requested by
  // HTTP that is itself shorter; above it the picture is refused, which bounds the delay of
  // admitted ones.
  double wait_ms = 25;
  // Proxies whose X-Forwarded-For is trusted: addresses, or networks as ADDRESS/BITS.
  std::vector<std::string> trusted_proxies;
  // Header in which they name the user, who is then counted in place of the address; empty: none.
  std::string identity_header;

  // Limits as published to clients, capped by the protocol's own.
  [[nodiscard]] std::int64_t pixels_max_reported() const {
    constexpr std::int64_t most = protocol::limits::image_pixels_max;
    return pixels > 0 && pixels < most ? pixels : most;
  }
};

}  // namespace windsplat::access
