// Whose connection it is: IP addresses as they count, networks that hold them, and what proxies
// say.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace windsplat::net {

// An address as limits count it: IPv4 as it is, also where it is mapped into IPv6; of IPv6 the
// network of 64 bits ("2001:db8:1:2::/64"), all of which one host may have. What is no address
// stays as it is.
std::string counted_address(std::string_view address);

// ADDRESS or ADDRESS/BITS.
class Network {
 public:
  static std::optional<Network> parse(std::string_view text);
  [[nodiscard]] bool holds(std::string_view address) const;

 private:
  std::array<std::uint8_t, 16> bytes_{};  // IPv4 mapped into IPv6
  unsigned bits_ = 128;
};

// The address of whoever asks: the peer's, or where that is a trusted proxy the last element of
// X-Forwarded-For that is none. Where the header says nothing that is an address, the peer's.
std::string client_address(const std::string& peer, std::string_view forwarded_for,
                           const std::vector<Network>& trusted);
bool is_trusted(std::string_view peer, const std::vector<Network>& trusted);

}  // namespace windsplat::net
