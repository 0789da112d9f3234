// The WebSocket layer of one connection. Include in WebSocket sources only: it is heavy to compile.
#pragma once

#include <boost/beast/websocket/stream.hpp>
#include <chrono>

#include "server/session/pacing/link.hpp"
#include "server/transport/wire.hpp"

namespace windsplat::transport {

namespace websocket = beast::websocket;
using WebSocketStream = websocket::stream<Wire>;

// The clock of sessions.
inline session::Micros now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace windsplat::transport
