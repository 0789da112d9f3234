// The WebSocket of one session: messages in, text and frames out. Control messages have priority;
// one frame is written at a time.
#pragma once

#include <string>

#include "server/api/router.hpp"
#include "server/transport/connections.hpp"
#include "server/transport/wire.hpp"

namespace windsplat::transport {

// Client of the session: the address charged, and its places among connections and sessions.
struct Guest {
  std::string address;
  access::Ticket connection;
  access::Ticket session;
};

// `request` is an authorised upgrade (auth.hpp); `request_id` names it in the response and the log.
void start_websocket_session(Wire wire, const UpgradeRequest& request, std::string request_id,
                             api::Services& services, Connections& connections, Guest guest);

}  // namespace windsplat::transport
