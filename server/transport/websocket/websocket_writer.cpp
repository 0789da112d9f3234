#include "server/transport/websocket/websocket_writer.hpp"

#include <array>
#include <utility>

#include "protocol/codec.hpp"
#include "protocol/limits.hpp"

namespace windsplat::transport {

WebSocketWriter::WebSocketWriter(StreamOwner& owner, WebSocketStream& socket,
                                 metrics::Metrics& metrics, access::Admission& admission,
                                 const std::string& address, StreamEvents& events)
    : owner_(owner),
      socket_(socket),
      metrics_(metrics),
      admission_(admission),
      address_(address),
      events_(events),
      queue_(metrics),
      timer_(socket.get_executor()) {}

void WebSocketWriter::send(const protocol::ServerMessage& message) {
  queue_.add(protocol::encode(message));
  pump();
}

void WebSocketWriter::queue_frame(session::SendFrame effect) {
  queue_.set({protocol::encode_frame_header(effect.header), std::move(effect.payload), effect.tier,
              effect.header, effect.stands_in});
}

void WebSocketWriter::ping(std::uint32_t seq) {
  if (pinging_ || !owner_.is_open()) return;
  pinging_ = true;
  const std::string text = std::to_string(seq);
  socket_.async_ping(websocket::ping_data(text.data(), text.size()),
                     owner_.handler([this](ErrorCode /*fault*/) { pinging_ = false; }));
}

void WebSocketWriter::pump() {
  if (writing_ || !owner_.is_open()) return;
  if (!queue_.texts().empty()) {
    const std::string& text = queue_.texts().front();
    write(asio::buffer(text), text.size(), true);
  } else if (const auto& frame = queue_.frame()) {
    const std::array<asio::const_buffer, 2> parts{
        asio::buffer(frame->header), asio::buffer(frame->payload->data(), frame->payload->size())};
    write(parts, frame->bytes(), false);
  }
}

template <class Buffers>
void WebSocketWriter::write(const Buffers& buffers, std::size_t bytes, bool is_text) {
  writing_ = true;
  written_since_ = now_us();
  timer_.expires_after(write_deadline(bytes, protocol::limits::write_timeout_s));
  timer_.async_wait(owner_.handler([this](ErrorCode fault) {
    // The timer may expire just as the last write ends.
    if (fault || !writing_ || timer_.expiry() > std::chrono::steady_clock::now()) return;
    log::info("closing session: client too slow",
              {{"session", owner_.id()}, {"request", owner_.request_id()}});
    owner_.abort();
  }));
  socket_.text(is_text);
  socket_.async_write(buffers, owner_.handler([this, is_text](ErrorCode fault, std::size_t sent) {
    writing_ = false;
    metrics_.bytes_sent(metrics::Metrics::Over::stream, sent);
    admission_.sent(address_, sent);
    timer_.cancel();
    if (owner_.has_ended()) return;
    if (fault) return owner_.on_disconnected();
    on_written(is_text);
  }));
}

void WebSocketWriter::on_written(bool is_text) {
  if (is_text) {
    queue_.pop_text();
    pump();
    owner_.on_text_written();
  } else {
    metrics_.stage_took(metrics::Metrics::Stage::write, now_us() - written_since_);
    const QueuedFrame& frame = *queue_.frame();
    metrics_.frame_sent(frame.tier, frame.facts, frame.stands_in);
    queue_.pop_frame();
    events_.on_frame_written();
  }
}

}  // namespace windsplat::transport
