// State of the remote end of a socket.
#pragma once

namespace windsplat::transport {

// Whether the peer has closed its side or the connection is broken, even behind unread data.
// `handle`: descriptor of a TCP socket.
bool peer_has_left(int handle);

}  // namespace windsplat::transport
