// One viewer's WebSocket: messages -> session -> text and frames. Control messages go first; one
// frame is under way at a time.
#pragma once

#include "server/net/connections.hpp"
#include "server/net/router.hpp"
#include "server/net/stream.hpp"

namespace windsplat::net {

// `request` is an upgrade whose origin was checked.
void start_websocket_session(TcpStream stream, UpgradeRequest request, Services& services,
                             Connections& connections);

}  // namespace windsplat::net
