// One viewer's WebSocket: messages -> session -> text and frames. Control messages go first; one
// frame is under way at a time.
#pragma once

#include <string>

#include "server/api/router.hpp"
#include "server/transport/connections.hpp"
#include "server/transport/wire.hpp"

namespace windsplat::net {

// Whose session it is: the address that it is charged to, and its places among connections and
// sessions.
struct Guest {
  std::string address;
  Ticket connection;
  Ticket session;
};

// `request` is an upgrade that was let in (auth.hpp); `request_id` names it in the answer and the
// log.
void start_websocket_session(Wire wire, UpgradeRequest request, std::string request_id,
                             Services& services, Connections& connections, Guest guest);

}  // namespace windsplat::net
