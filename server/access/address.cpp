// Parses and formats addresses as 16 bytes.
#include "server/access/address.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <cstring>

#include "server/http/exchange.hpp"

namespace windsplat::access {
namespace {

using Bytes = std::array<std::uint8_t, 16>;

constexpr std::size_t text_max = 64;  // longer than any address with a zone
constexpr std::size_t mapped_prefix = 12;
constexpr std::size_t counted_bytes = 8;  // network part of an IPv6 address: 64 bits

// The zone ("%eth0") names the interface and is not part of the address.
std::optional<Bytes> parse_bytes(std::string_view text) {
  if (text.size() > text_max) return std::nullopt;
  const std::string plain(text.substr(0, text.find('%')));
  Bytes bytes{};
  if (::inet_pton(AF_INET6, plain.c_str(), bytes.data()) == 1) return bytes;
  bytes.fill(0);
  bytes[10] = bytes[11] = 0xff;
  if (::inet_pton(AF_INET, plain.c_str(), bytes.data() + mapped_prefix) == 1) return bytes;
  return std::nullopt;
}

bool is_v4(const Bytes& bytes) {
  return std::all_of(bytes.begin(), bytes.begin() + 10, [](auto byte) { return byte == 0; }) &&
         bytes[10] == 0xff && bytes[11] == 0xff;
}

std::string text_of(const Bytes& bytes) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const bool v4 = is_v4(bytes);
  (void)::inet_ntop(v4 ? AF_INET : AF_INET6, bytes.data() + (v4 ? mapped_prefix : 0), text.data(),
                    text.size());
  return text.data();
}

// "192.0.2.1:443", "[2001:db8::1]:443" or bare.
std::string_view without_port(std::string_view text) {
  if (text.starts_with('[')) return text.substr(1, text.find(']') - 1);
  const std::size_t colon = text.find(':');
  const bool only_one = colon != std::string_view::npos && colon == text.rfind(':');
  return only_one ? text.substr(0, colon) : text;
}

}  // namespace

std::string counted_address(std::string_view address) {
  auto bytes = parse_bytes(address);
  if (!bytes) return std::string(address.substr(0, text_max));
  if (is_v4(*bytes)) return text_of(*bytes);
  std::fill(bytes->begin() + counted_bytes, bytes->end(), std::uint8_t{0});
  return text_of(*bytes) + "/64";
}

std::optional<Network> Network::parse(std::string_view text) {
  if (text == "unix") {
    Network local;
    local.unix_ = true;
    return local;
  }
  const std::size_t slash = text.find('/');
  const auto bytes = parse_bytes(text.substr(0, slash));
  if (!bytes || text.find('%') != std::string_view::npos) return std::nullopt;
  Network network;
  network.bytes_ = *bytes;
  if (slash == std::string_view::npos) return network;
  const unsigned before = is_v4(*bytes) ? 8 * mapped_prefix : 0;
  const std::string_view digits = text.substr(slash + 1);
  unsigned bits = 0;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), bits);
  const bool whole = read.ec == std::errc() && read.ptr == digits.data() + digits.size();
  if (!whole || bits > 128 - before) return std::nullopt;
  network.bits_ = bits + before;
  return network;
}

bool Network::holds(std::string_view address) const {
  if (unix_) return address.starts_with(unix_peer);
  const auto bytes = parse_bytes(address);
  if (!bytes) return false;
  const std::size_t whole = bits_ / 8;
  if (std::memcmp(bytes->data(), bytes_.data(), whole) != 0) return false;
  const unsigned rest = bits_ % 8;
  if (rest == 0) return true;
  const unsigned mask = 0xff00U >> rest & 0xffU;
  return ((*bytes)[whole] & mask) == (bytes_[whole] & mask);
}

bool is_trusted(std::string_view peer, const std::vector<Network>& trusted) {
  return std::any_of(trusted.begin(), trusted.end(),
                     [&](const Network& network) { return network.holds(peer); });
}

std::string client_address(const std::string& peer, std::string_view forwarded_for,
                           const std::vector<Network>& trusted) {
  if (!is_trusted(peer, trusted)) return peer;
  const auto hops = http::split_list(forwarded_for, ',');
  std::string client = peer;
  for (auto hop = hops.rbegin(); hop != hops.rend(); ++hop) {
    const std::string_view address = without_port(*hop);
    if (!parse_bytes(address)) return client;  // the element was not written by a trusted proxy
    client = address;
    if (!is_trusted(address, trusted)) return client;
  }
  return client;
}

}  // namespace windsplat::access
