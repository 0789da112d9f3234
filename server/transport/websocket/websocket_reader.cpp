#include "server/transport/websocket/websocket_reader.hpp"

#include <boost/asio/post.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <chrono>

#include "protocol/limits.hpp"

namespace windsplat::transport {
WebSocketReader::WebSocketReader(StreamOwner& owner, WebSocketStream& socket,
                                 access::Admission& admission, const std::string& address,
                                 const WriteQueue& queue, StreamEvents& events)
    : owner_(owner),
      socket_(socket),
      admission_(admission),
      address_(address),
      queue_(queue),
      events_(events),
      buffer_(protocol::limits::message_bytes_max + 1024),
      watch_timer_(socket.get_executor()),
      pause_timer_(socket.get_executor()) {}

void WebSocketReader::prepare() {
  socket_.read_message_max(protocol::limits::message_bytes_max);
  socket_.control_callback([this](websocket::frame_type kind, beast::string_view payload) {
    on_control(kind, payload);
  });
}

void WebSocketReader::start() {
  socket_.next_layer().forget();
  meter_.heard_whole();
  read();
}

void WebSocketReader::stop() {
  watch_timer_.cancel();
  pause_timer_.cancel();
}

void WebSocketReader::read() {
  reading_ = true;
  socket_.async_read(buffer_, owner_.handler([this](ErrorCode fault, std::size_t) {
    reading_ = false;
    if (owner_.has_ended()) return;
    if (fault) return owner_.on_disconnected();
    on_message();
  }));
  watch();
}

void WebSocketReader::on_message() {
  socket_.next_layer().forget();
  meter_.heard_whole();
  if (owner_.is_open()) {
    if (socket_.got_text()) {
      events_.on_text(beast::buffers_to_string(buffer_.data()));
    } else {
      events_.on_binary();
    }
  }
  charge(buffer_.size());
  buffer_.consume(buffer_.size());
  resume();
}

// While closing, the close operation itself reads until the peer's close: a further read would
// deadlock with it.
void WebSocketReader::resume() {
  if (reading_ || paused_ || !owner_.is_open() || queue_.is_backlogged()) return;
  read();
}

// Pauses reading from an address above its rate until it is within the limit.
void WebSocketReader::charge(std::size_t bytes) {
  const std::chrono::microseconds wait(admission_.message_received(address_, bytes));
  if (wait.count() == 0 || !owner_.is_open()) return;
  paused_ = true;
  pause_timer_.expires_after(wait);
  pause_timer_.async_wait(owner_.handler([this](ErrorCode /*fault*/) {
    paused_ = false;
    resume();
  }));
}

// Pings are handled within a read, which cannot be paused: too many close the connection.
void WebSocketReader::on_control(websocket::frame_type kind, beast::string_view payload) {
  if (!meter_.heard_control(payload.size(), socket_.next_layer().bytes_read())) {
    asio::post(socket_.get_executor(),
               owner_.handler([this] { owner_.close(close_policy, "too many pings"); }));
  }
  if (kind == websocket::frame_type::pong) events_.on_pong({payload.data(), payload.size()});
}

void WebSocketReader::watch() {
  if (watching_) return;
  watching_ = true;
  watch_timer_.expires_after(std::chrono::seconds(1));
  watch_timer_.async_wait(owner_.handler([this](ErrorCode fault) {
    watching_ = false;
    if (fault || owner_.has_ended()) return;
    if (events_.has_lost_reply()) return end_failed(owner_, "a reply was lost");
    switch (meter_.check(socket_.next_layer().bytes_read(), MessageMeter::Clock::now())) {
      case MessageMeter::Verdict::too_slow:
        return owner_.abort();
      case MessageMeter::Verdict::too_long:
        return owner_.close(close_too_big, "the message is too long");
      case MessageMeter::Verdict::fine:
        return watch();
    }
  }));
}

}  // namespace windsplat::transport
