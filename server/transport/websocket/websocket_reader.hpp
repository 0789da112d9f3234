// The receiving side of a WebSocket, with limits on the size, rate and time of messages.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <cstddef>
#include <string>

#include "server/access/admission.hpp"
#include "server/transport/websocket/message_meter.hpp"
#include "server/transport/websocket/stream_events.hpp"
#include "server/transport/websocket/stream_owner.hpp"
#include "server/transport/websocket/websocket_stream.hpp"
#include "server/transport/websocket/write_queue.hpp"

namespace windsplat::transport {

class WebSocketReader {
 public:
  // Messages are charged to `address`. While the queue is backlogged, nothing is read.
  WebSocketReader(StreamOwner& owner, WebSocketStream& socket, access::Admission& admission,
                  const std::string& address, const WriteQueue& queue, StreamEvents& events);

  // Before the socket is accepted: limits the size of messages and listens to pings.
  void prepare();
  void start();
  void resume();  // the queue has become shorter
  void stop();    // ends the timers

 private:
  void read();
  void on_message();
  void charge(std::size_t bytes);
  void on_control(websocket::frame_type kind, beast::string_view payload);
  void watch();

  StreamOwner& owner_;
  WebSocketStream& socket_;
  access::Admission& admission_;
  const std::string& address_;
  const WriteQueue& queue_;
  StreamEvents& events_;
  beast::flat_buffer buffer_;
  MessageMeter meter_;
  asio::steady_timer watch_timer_;
  asio::steady_timer pause_timer_;  // until the message quota allows reading
  bool reading_ = false;
  bool paused_ = false;
  bool watching_ = false;
};

}  // namespace windsplat::transport
