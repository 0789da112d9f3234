// Splits at the last colon; inet_pton() parses addresses, getaddrinfo() looks names up.
#include "server/cli/serve/listen_address.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <memory>
#include <system_error>
#include <utility>

#include "server/transport/unix_socket.hpp"

namespace windsplat::cli {
namespace {

constexpr std::string_view unix_prefix = "unix:";

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

bool is_name(const std::string& host) {
  const bool any_letter = std::any_of(host.begin(), host.end(), [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
  });
  return any_letter && std::all_of(host.begin(), host.end(), [](unsigned char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '-' || c == '.' || c == '_';
         });
}

std::string text_of(const addrinfo& one) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (one.ai_family == AF_INET) {
    sockaddr_in address{};
    std::memcpy(&address, one.ai_addr, sizeof address);
    (void)inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
  } else if (one.ai_family == AF_INET6) {
    sockaddr_in6 address{};
    std::memcpy(&address, one.ai_addr, sizeof address);
    (void)inet_ntop(AF_INET6, &address.sin6_addr, text.data(), text.size());
  }
  return text.data();
}

// All addresses of a name, those of IPv4 first, each once.
Result<ListenPlaces> look_up(const std::string& name, std::uint16_t port) {
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int fault = ::getaddrinfo(name.c_str(), nullptr, &wanted, &found);
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> held(found, &::freeaddrinfo);
  if (fault != 0) {
    return make_error(ErrorKind::invalid,
                      "--listen '" + printable(name) +
                          "': the name has no address here: " + printable(::gai_strerror(fault)));
  }
  ListenPlaces listen;
  for (const int family : {AF_INET, AF_INET6}) {
    for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
      if (one->ai_family != family) continue;
      const std::string address = text_of(*one);
      const bool known = std::any_of(listen.places.begin(), listen.places.end(),
                                     [&](const auto& place) { return place.address == address; });
      if (known) continue;
      bool loopback = false;
      (void)(family == AF_INET ? parse_v4(address, loopback) : parse_v6(address, loopback));
      listen.loopback = listen.loopback && loopback;
      listen.places.push_back({address, port, "", 0, true});
    }
  }
  return listen;
}

Result<ListenPlaces> unix_place(std::string_view text) {
  const std::string path(text.substr(unix_prefix.size()));
  if (!path.starts_with('/') || path.find('\0') != std::string::npos) {
    return make_error(ErrorKind::malformed, "--listen '" + printable(text) +
                                                "' is not unix: and an absolute path, such as "
                                                "unix:/run/windsplat/windsplat.sock");
  }
  if (path.size() > transport::unix_path_bytes_max) {
    return make_error(ErrorKind::malformed,
                      "--listen '" + printable(text) + "': the path is longer than " +
                          std::to_string(transport::unix_path_bytes_max) + " bytes");
  }
  ListenPlaces listen;
  listen.places.push_back({"", 0, path});
  return listen;
}

}  // namespace

Result<ListenPlaces> parse_listen_place(std::string_view text) {
  if (text.starts_with(unix_prefix)) return unix_place(text);
  const Error malformed =
      make_error(ErrorKind::malformed,
                 "--listen '" + printable(text) +
                     "' is not of the form 127.0.0.1:8080, [::1]:8080, name:8080, :8080 or "
                     "unix:/run/windsplat/windsplat.sock");
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return malformed;
  api::ListenPlace place;
  const std::string_view port = text.substr(colon + 1);
  const char* const end = port.data() + port.size();
  const auto [next, fault] = std::from_chars(port.data(), end, place.port);
  if (port.empty() || fault != std::errc() || next != end) return malformed;

  ListenPlaces listen;
  const std::string host(text.substr(0, colon));
  if (!host.empty()) {
    const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
    place.address = bracketed ? host.substr(1, host.size() - 2) : host;
    const bool known = bracketed ? parse_v6(place.address, listen.loopback)
                                 : parse_v4(place.address, listen.loopback);
    if (!known) return !bracketed && is_name(host) ? look_up(host, place.port) : malformed;
  }
  listen.places.push_back(std::move(place));
  return listen;
}

Result<ListenPlaces> listen_places(const std::vector<std::string>& texts, std::string_view mode) {
  unsigned bits = 0;
  constexpr int octal = 8;
  constexpr unsigned mode_max = 0777;
  const auto [next, fault] = std::from_chars(mode.data(), mode.data() + mode.size(), bits, octal);
  if (mode.size() < 3 || fault != std::errc() || next != mode.data() + mode.size() ||
      bits > mode_max) {
    return make_error(ErrorKind::malformed, "--listen-mode '" + printable(mode) +
                                                "' is not a mode in octal digits such as 0660");
  }
  ListenPlaces all;
  for (const std::string& text : texts) {
    auto some = parse_listen_place(text);
    if (!some) return some;
    all.loopback = all.loopback && some->loopback;
    for (api::ListenPlace& place : some->places) {
      place.mode = bits;
      all.places.push_back(std::move(place));
    }
  }
  return all;
}

}  // namespace windsplat::cli
