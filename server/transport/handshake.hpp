// Turns an accepted connection into an HTTP session, after a TLS handshake if TLS is enabled.
#pragma once

#include <boost/asio/ip/tcp.hpp>

#include "server/api/router.hpp"
#include "server/transport/connections.hpp"
#include "server/transport/handshake_thread.hpp"

namespace windsplat::transport {

// `handshakes` null: plain TCP. Stop it before the socket's io_context ends.
void start_connection(boost::asio::ip::tcp::socket socket, api::Services& services,
                      Connections& connections, HandshakeThread* handshakes,
                      access::Visitor visitor);

}  // namespace windsplat::transport
