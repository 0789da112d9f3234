// Splits at the last colon; inet_pton() parses the address.
#include "server/cli/serve/listen_address.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <charconv>
#include <system_error>

namespace windsplat::cli {
namespace {

bool parse_v4(const std::string& host, bool& loopback) {
  in_addr address{};
  if (inet_pton(AF_INET, host.c_str(), &address) != 1) return false;
  loopback = ntohl(address.s_addr) >> 24 == 127;
  return true;
}

bool parse_v6(const std::string& host, bool& loopback) {
  in6_addr address{};
  if (inet_pton(AF_INET6, host.c_str(), &address) != 1) return false;
  loopback = IN6_IS_ADDR_LOOPBACK(&address) != 0;
  return true;
}

}  // namespace

Result<ListenAddress> parse_listen_address(std::string_view text) {
  const Error malformed =
      make_error(ErrorKind::malformed,
                 "--listen '" + printable(text) +
                     "' is not of the form 127.0.0.1:8080, [::1]:8080 or :8080 (numeric address)");
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return malformed;
  ListenAddress listen;
  const std::string_view port = text.substr(colon + 1);
  const char* const end = port.data() + port.size();
  const auto [next, fault] = std::from_chars(port.data(), end, listen.port);
  if (port.empty() || fault != std::errc() || next != end) return malformed;

  const std::string host(text.substr(0, colon));
  if (host.empty() || host == "localhost") return listen;
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  listen.address = bracketed ? host.substr(1, host.size() - 2) : host;
  const bool known = bracketed ? parse_v6(listen.address, listen.loopback)
                               : parse_v4(listen.address, listen.loopback);
  if (!known) return malformed;
  return listen;
}

}  // namespace windsplat::cli
