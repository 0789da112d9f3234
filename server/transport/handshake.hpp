// A connection that was accepted -> an HTTP session, by way of a TLS handshake where there is TLS.
#pragma once

#include <boost/asio/ip/tcp.hpp>

#include "server/api/router.hpp"
#include "server/transport/connections.hpp"
#include "server/transport/handshake_thread.hpp"

namespace windsplat::net {

// `handshakes` null: plain TCP. It must be stopped before the socket's io_context ends.
void start_connection(boost::asio::ip::tcp::socket socket, Services& services,
                      Connections& connections, HandshakeThread* handshakes, Visitor visitor);

}  // namespace windsplat::net
