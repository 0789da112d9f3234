// What the system knows of the other end of a socket.
#pragma once

namespace windsplat::net {

// Whether the peer has closed its side, or the connection is broken, also where unread bytes lie
// before that end. `handle`: a TCP socket's descriptor.
bool peer_has_left(int handle);

}  // namespace windsplat::net
