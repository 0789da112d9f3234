// How much one address and all of them together may take of the server. 0 is no limit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/limits.hpp"

namespace windsplat::net {

// An address is an IPv4 address or an IPv6 network of 64 bits (address.hpp). The defaults are meant
// never to be met by people, a room of them behind one address among these;
// docs/user/configuration.md says what happens at each.
struct Limits {
  std::size_t connections = 512;
  std::size_t connections_per_address = 256;
  // New ones a second, ten seconds' worth at once; one in TLS counts as Quota::tls_arrivals. In all
  // only those of addresses are refused that had more than a second's worth of late.
  double arrivals = 2000;
  double arrivals_per_address = 500;
  // Processor time of TLS handshakes, milliseconds a second; ten seconds' worth at once, and what a
  // handshake under way takes may go beyond. In total for addresses that have not shown the token
  // recently, and as much again for those that have; 127.0.0.1 and ::1 have the address's alone.
  double handshake_ms = 250;
  double handshake_ms_per_address = 100;
  std::size_t sessions_per_address = 48;  // all of them: ServerOptions::sessions_max
  double requests_per_address = 1000;     // a second; ten seconds' worth may come at once
  double messages_per_address = 4000;     // of streams, a second
  double received_per_address = 8e6;      // bytes of those messages a second
  double bytes_per_address = 0;           // sent, a second; one answer may go beyond
  double render_s_per_address = 0;        // of the renderer, a minute; one may go beyond
  double failed_logins_per_address = 30;  // a minute
  std::int64_t pixels = protocol::limits::image_pixels_max;  // of a picture
  double kernels = 1e10;                                     // of a picture (cost.hpp)
  double render_s = 120;  // to draw a picture asked for by HTTP, as far as that can be told
  // A picture asked for by HTTP is refused where those of other addresses will keep it waiting
  // longer than this and than it takes itself, milliseconds: so nobody who is let in waits much
  // longer than where there is nobody else.
  double wait_ms = 25;
  // Peers whose X-Forwarded-For is believed: addresses, or networks as ADDRESS/BITS.
  std::vector<std::string> trusted_proxies;

  // What clients are told: the protocol has a limit of its own.
  [[nodiscard]] std::int64_t pixels_max_reported() const {
    constexpr std::int64_t most = protocol::limits::image_pixels_max;
    return pixels > 0 && pixels < most ? pixels : most;
  }
};

}  // namespace windsplat::net
