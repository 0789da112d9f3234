// Which hosts and addresses files may be fetched from.
#pragma once

#include <sys/socket.h>

#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/url.hpp"

namespace windsplat::data::fetch {

enum class Reach {
  everyone,  // globally reachable
  site,      // private or shared networks, unique local addresses, loopback (RFC 1918, 6598, 4193)
  never,     // link-local, metadata services, multicast, unspecified, reserved, not IP
};

// Classifies the address of a socket by the registries of special-purpose addresses (RFC 6890);
// an IPv6 address that contains an IPv4 address (mapped, NAT64, 6to4) as the stricter of both.
Reach reach_of(const sockaddr* address);

// The hosts of --data-host.
class HostRules {
 public:
  HostRules() = default;  // permits none
  // Each "HOST[:PORT]" or "https://HOST[:PORT]" permits TLS, "http://HOST[:PORT]" plain HTTP; no
  // PORT means that of the scheme. Errors: invalid, naming the host.
  static Result<HostRules> parse(const std::vector<std::string>& hosts, bool site_addresses);

  // Errors: invalid, if scheme, host and port are not those of a permitted host.
  [[nodiscard]] Result<void> check(const Url& url) const;
  [[nodiscard]] bool permits(const sockaddr* address) const;
  [[nodiscard]] bool empty() const { return origins_.empty(); }

 private:
  std::vector<std::string> origins_;  // "https://host:port", without a default port
  bool site_addresses_ = false;
};

}  // namespace windsplat::data::fetch
