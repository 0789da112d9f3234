// "--listen HOST:PORT" -> address and port.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "server/base/error.hpp"

namespace windsplat::cli {

struct ListenAddress {
  std::string address = "127.0.0.1";  // IPv4 or IPv6, numeric, without brackets
  std::uint16_t port = 8080;          // 0: any free port
  bool loopback = true;               // reachable only from this machine
};

// "127.0.0.1:8080", "[::1]:8080", "localhost:80", ":0" (127.0.0.1). Errors: malformed.
Result<ListenAddress> parse_listen_address(std::string_view text);

}  // namespace windsplat::cli
