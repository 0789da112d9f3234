// The sending side of a WebSocket: one write at a time, each with a time limit.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <string>

#include "server/access/admission.hpp"
#include "server/metrics/metrics.hpp"
#include "server/session/effects.hpp"
#include "server/transport/websocket/stream_events.hpp"
#include "server/transport/websocket/stream_owner.hpp"
#include "server/transport/websocket/websocket_stream.hpp"
#include "server/transport/websocket/write_queue.hpp"

namespace windsplat::transport {

class WebSocketWriter {
 public:
  // `address` is charged with the bytes sent.
  WebSocketWriter(StreamOwner& owner, WebSocketStream& socket, metrics::Metrics& metrics,
                  access::Admission& admission, const std::string& address, StreamEvents& events);

  [[nodiscard]] const WriteQueue& queue() const { return queue_; }
  void send(const protocol::ServerMessage& message);
  // Written by the next pump() that finds no text waiting.
  void queue_frame(session::SendFrame effect);
  void ping(std::uint32_t seq);  // sent by the layer below before the next write
  void pump();
  void stop() { timer_.cancel(); }

 private:
  template <class Buffers>
  void write(const Buffers& buffers, std::size_t bytes, bool is_text);
  void on_written(bool is_text);

  StreamOwner& owner_;
  WebSocketStream& socket_;
  metrics::Metrics& metrics_;
  access::Admission& admission_;
  const std::string& address_;
  StreamEvents& events_;
  WriteQueue queue_;
  asio::steady_timer timer_;
  session::Micros written_since_ = 0;
  bool writing_ = false;
  bool pinging_ = false;
};

}  // namespace windsplat::transport
