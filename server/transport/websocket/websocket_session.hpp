// The WebSocket of one session: messages in, text and frames out. Control messages have priority;
// one frame is written at a time.
#pragma once

#include <atomic>
#include <string>

#include "server/access/admission.hpp"
#include "server/api/server_options.hpp"
#include "server/tasks/backend.hpp"
#include "server/transport/connections.hpp"
#include "server/transport/stream.hpp"

namespace windsplat::transport {

class Wire;

// What the sessions of a server share; outlives them.
struct StreamContext {
  const api::ServerOptions& options;
  tasks::Backend& backend;
  access::Admission& admission;
  const std::atomic<bool>& draining;
  Connections& connections;
};

// Client of the session: the address charged, and its slots among connections and sessions.
struct Guest {
  std::string address;
  access::Ticket connection;
  access::Ticket session;
};

// `request` is an authorised upgrade (auth.hpp); `request_id` names it in the response and the log.
void start_websocket_session(const StreamContext& context, Wire wire, const UpgradeRequest& request,
                             std::string request_id, Guest guest);

}  // namespace windsplat::transport
