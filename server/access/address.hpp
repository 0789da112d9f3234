// Client addresses: IP addresses as counted by the quotas, networks, and the headers of proxies.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace windsplat::access {

// Address as counted by quotas: IPv4 unchanged, including IPv4 mapped into IPv6; of IPv6 the
// network of 64 bits ("2001:db8:1:2::/64"), which one host may own entirely. Text that is not an
// address is returned unchanged.
std::string counted_address(std::string_view address);

// Peers of a UNIX socket: this and the number of their user. Each user counts as an address.
inline constexpr const char* unix_peer = "unix:";

// ADDRESS, ADDRESS/BITS, or "unix": every peer of a UNIX socket.
class Network {
 public:
  static std::optional<Network> parse(std::string_view text);
  [[nodiscard]] bool holds(std::string_view address) const;

 private:
  std::array<std::uint8_t, 16> bytes_{};  // IPv4 mapped into IPv6
  unsigned bits_ = 128;
  bool unix_ = false;
};

// The client's address: the peer's, or behind a trusted proxy the last untrusted element of
// X-Forwarded-For. The peer's if the header has no address.
std::string client_address(const std::string& peer, std::string_view forwarded_for,
                           const std::vector<Network>& trusted);
bool is_trusted(std::string_view peer, const std::vector<Network>& trusted);

}  // namespace windsplat::access
