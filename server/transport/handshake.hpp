// Turns an accepted connection into an HTTP session, after a TLS handshake if TLS is enabled.
#pragma once

#include <boost/asio/generic/stream_protocol.hpp>

#include "server/access/admission.hpp"
#include "server/transport/handshake_thread.hpp"
#include "server/transport/http/http_session.hpp"

namespace windsplat::transport {

// `handshakes` null: plain TCP. Stop it before the socket's io_context ends.
void start_connection(const HttpContext& context,
                      boost::asio::generic::stream_protocol::socket socket,
                      HandshakeThread* handshakes, access::Visitor visitor);

}  // namespace windsplat::transport
