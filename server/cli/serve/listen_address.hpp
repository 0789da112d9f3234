// "--listen" -> the places where the server listens.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/api/server_options.hpp"
#include "server/base/error.hpp"

namespace windsplat::cli {

struct ListenPlaces {
  std::vector<api::ListenPlace> places;
  bool loopback = true;  // all are reachable only from this machine
};

// "127.0.0.1:8080", "[::1]:8080", ":0" (127.0.0.1), "name:80" with all addresses of the name, or
// "unix:/run/windsplat.sock". A name is looked up. Errors: malformed; invalid: the name has no
// address.
Result<ListenPlaces> parse_listen_place(std::string_view text);

// Several of them; `mode` of the files of UNIX sockets, in octal digits.
Result<ListenPlaces> listen_places(const std::vector<std::string>& texts, std::string_view mode);

}  // namespace windsplat::cli
