#include "server/data/fetch/host_rules.hpp"

#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

namespace windsplat::data::fetch {

namespace {

struct Range4 {
  std::uint32_t first;  // host byte order
  int bits;
  Reach reach;
};
// RFC 6890 and the IANA registry of IPv4 special-purpose addresses.
constexpr auto ranges4 = std::to_array<Range4>({
    {0x00000000, 8, Reach::never},   // this network
    {0x0A000000, 8, Reach::site},    // 10.0.0.0/8
    {0x646464C8, 32, Reach::never},  // 100.100.100.200, a metadata service
    {0x64400000, 10, Reach::site},   // 100.64.0.0/10, shared
    {0x7F000000, 8, Reach::site},    // loopback
    {0xA9FE0000, 16, Reach::never},  // 169.254.0.0/16, link-local, metadata services
    {0xAC100000, 12, Reach::site},   // 172.16.0.0/12
    {0xC0000000, 24, Reach::never},  // 192.0.0.0/24, protocol assignments
    {0xC0000200, 24, Reach::never},  // documentation
    {0xC0586300, 24, Reach::never},  // 6to4 relays
    {0xC0A80000, 16, Reach::site},   // 192.168.0.0/16
    {0xC6120000, 15, Reach::never},  // benchmarks
    {0xC6336400, 24, Reach::never},  // documentation
    {0xCB007100, 24, Reach::never},  // documentation
    {0xE0000000, 3, Reach::never},   // multicast and reserved
});

using Bytes16 = std::array<std::uint8_t, 16>;

struct Range6 {
  Bytes16 first;
  int bits;
  Reach reach;
};
constexpr auto ranges6 = std::to_array<Range6>({
    {{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, 128, Reach::site},  // ::1
    {{0xFD, 0, 0x0E, 0xC2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x02, 0x54},
     128,
     Reach::never},                                // fd00:ec2::254, a metadata service
    {{0xFC}, 7, Reach::site},                      // unique local
    {{0x20, 0x01, 0x0D, 0xB8}, 32, Reach::never},  // documentation
    {{0x20, 0x01, 0}, 23, Reach::never},           // protocol assignments, Teredo
    {{0x20}, 3, Reach::everyone},                  // global unicast; everything else is refused
});

bool starts_alike(const Bytes16& a, const Bytes16& b, int bits) {
  for (int bit = 0; bit < bits; ++bit) {
    const auto byte = static_cast<std::size_t>(bit / 8);
    if (((a.at(byte) ^ b.at(byte)) >> (7U - static_cast<unsigned>(bit) % 8U) & 1U) != 0)
      return false;
  }
  return true;
}

Reach reach_of4(std::uint32_t address) {
  for (const Range4& range : ranges4) {
    if (((address ^ range.first) >> (32U - static_cast<unsigned>(range.bits))) == 0) {
      return range.reach;
    }
  }
  return Reach::everyone;
}

std::uint32_t four_bytes(const Bytes16& address, std::size_t from) {
  std::uint32_t out = 0;
  for (std::size_t i = from; i < from + 4; ++i) out = out << 8U | address.at(i);
  return out;
}

Reach reach_of6(const Bytes16& address) {
  constexpr Bytes16 mapped{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};  // RFC 4291, 2.5.5.2
  constexpr Bytes16 nat64{0, 0x64, 0xFF, 0x9B};                        // RFC 6052
  constexpr Bytes16 six_to_four{0x20, 0x02};                           // RFC 3056
  if (starts_alike(address, mapped, 96)) return reach_of4(four_bytes(address, 12));
  if (starts_alike(address, nat64, 96)) return reach_of4(four_bytes(address, 12));
  if (starts_alike(address, six_to_four, 16)) return reach_of4(four_bytes(address, 2));
  for (const Range6& range : ranges6) {
    if (starts_alike(address, range.first, range.bits)) return range.reach;
  }
  return Reach::never;
}

std::string origin_of(const Url& url) {
  const std::string text = url.text();
  return text.substr(0, text.size() - url.path.size());
}

}  // namespace

Reach reach_of(const sockaddr* address) {
  if (address->sa_family == AF_INET) {
    sockaddr_in four{};
    std::memcpy(&four, address, sizeof four);
    return reach_of4(ntohl(four.sin_addr.s_addr));
  }
  if (address->sa_family != AF_INET6) return Reach::never;
  sockaddr_in6 six{};
  std::memcpy(&six, address, sizeof six);
  Bytes16 bytes{};
  std::memcpy(bytes.data(), &six.sin6_addr, bytes.size());
  return reach_of6(bytes);
}

Result<HostRules> HostRules::parse(const std::vector<std::string>& hosts, bool site_addresses) {
  HostRules out;
  out.site_addresses_ = site_addresses;
  for (const std::string& host : hosts) {
    const auto url = parse_url(looks_like_url(host) ? host : "https://" + host);
    if (!url || url->scheme == "s3" || url->path != "/") {
      return make_error(ErrorKind::invalid,
                        "--data-host " + in_quotes(without_secrets(host)) +
                            " is not a host such as data.example, data.example:8443 or "
                            "http://data.example");
    }
    out.origins_.push_back(origin_of(*url));
  }
  return out;
}

Result<void> HostRules::check(const Url& url) const {
  const std::string origin = origin_of(url);
  if (std::find(origins_.begin(), origins_.end(), origin) != origins_.end()) return {};
  std::string text =
      in_quotes(origin) +
      " is not a permitted host: files are fetched only from the hosts of --data-host";
  const std::string host = origin.substr(origin.find("://") + 3);
  const auto permits = [&](const std::string& other) {
    return std::find(origins_.begin(), origins_.end(), other) != origins_.end();
  };
  if (url.scheme == "http" && permits("https://" + host)) {
    text += "; --data-host " + host + " permits https, --data-host " + origin + " unencrypted http";
  } else if (permits("http://" + host)) {
    text += "; --data-host http://" + host + " permits unencrypted http, --data-host " + host +
            " https";
  }
  return make_error(ErrorKind::invalid, std::move(text));
}

bool HostRules::permits(const sockaddr* address) const {
  const Reach reach = reach_of(address);
  return reach == Reach::everyone || (reach == Reach::site && site_addresses_);
}

}  // namespace windsplat::data::fetch
