// The ends of a socket.
#pragma once

#include <cstdint>
#include <string>

namespace windsplat::transport {

// Whether the peer has closed its side or the connection is broken, even behind unread data.
// `handle`: descriptor of a TCP or UNIX socket.
bool peer_has_left(int handle);

// The peer as quotas know it: its address, or of a UNIX socket "unix:" and the number of the user
// that connected. Empty if it has left already.
std::string peer_of(int handle);

// The port of this end; 0 of a UNIX socket.
std::uint16_t port_of(int handle);

}  // namespace windsplat::transport
