// The state of a connection, and the names of its ends.
#include "server/transport/peer.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>

#include "server/access/address.hpp"

namespace windsplat::transport {
namespace {

using NameOf = int (*)(int, sockaddr*, socklen_t*);

// The name of one end; family AF_UNSPEC if there is none.
sockaddr_storage end_of(int handle, NameOf name_of) {
  sockaddr_storage name{};
  socklen_t size = sizeof name;
  if (name_of(handle, reinterpret_cast<sockaddr*>(&name), &size) != 0) name.ss_family = AF_UNSPEC;
  return name;
}

template <class Address>
Address as(const sockaddr_storage& name) {
  Address address{};
  std::memcpy(&address, &name, sizeof address);
  return address;
}

std::string user_of(int handle) {
  ucred who{};
  socklen_t size = sizeof who;
  if (::getsockopt(handle, SOL_SOCKET, SO_PEERCRED, &who, &size) != 0) return {};
  return access::unix_peer + std::to_string(who.uid);
}

}  // namespace

bool peer_has_left(int handle) {
  tcp_info info{};
  socklen_t size = sizeof info;
  if (::getsockopt(handle, IPPROTO_TCP, TCP_INFO, &info, &size) == 0) {
    return info.tcpi_state != TCP_ESTABLISHED;
  }
  pollfd state{handle, POLLRDHUP, 0};  // a UNIX socket
  return handle < 0 || ::poll(&state, 1, 0) != 0;
}

std::string peer_of(int handle) {
  const sockaddr_storage name = end_of(handle, ::getpeername);
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (name.ss_family == AF_INET) {
    const auto v4 = as<sockaddr_in>(name);
    (void)::inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
  } else if (name.ss_family == AF_INET6) {
    const auto v6 = as<sockaddr_in6>(name);
    (void)::inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
  } else if (name.ss_family == AF_UNIX) {
    return user_of(handle);
  }
  return text.data();
}

std::uint16_t port_of(int handle) {
  const sockaddr_storage name = end_of(handle, ::getsockname);
  if (name.ss_family == AF_INET) return ntohs(as<sockaddr_in>(name).sin_port);
  return name.ss_family == AF_INET6 ? ntohs(as<sockaddr_in6>(name).sin6_port) : 0;
}

}  // namespace windsplat::transport
