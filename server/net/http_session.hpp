// One HTTP connection: bytes -> checked Request -> router -> response bytes, one at a time, until
// it is closed or becomes a stream.
#pragma once

#include <boost/asio/ip/tcp.hpp>

#include "server/net/connections.hpp"
#include "server/net/router.hpp"

namespace windsplat::net {

void start_http_session(boost::asio::ip::tcp::socket socket, Services& services,
                        Connections& connections, Visitor visitor);

}  // namespace windsplat::net
