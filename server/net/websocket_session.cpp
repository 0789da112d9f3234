// The WebSocket edge: limits of what a peer may send and how long it may take; effects of the
// session carried out. All on the io thread.
#include "server/net/websocket_session.hpp"

#include <sys/socket.h>

#include <boost/asio/post.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "protocol/codec.hpp"
#include "protocol/frame_header.hpp"
#include "protocol/limits.hpp"
#include "server/net/exchange.hpp"
#include "server/net/viewer.hpp"
#include "server/session/session.hpp"

namespace windsplat::net {
namespace {

namespace limits = protocol::limits;
namespace websocket = beast::websocket;
using Clock = std::chrono::steady_clock;

constexpr int close_too_big = 1009;
constexpr int close_full = 1013;
constexpr int close_fault = 1011;
constexpr std::chrono::seconds handshake_timeout{5};
constexpr std::chrono::seconds silence_timeout{60};  // a ping at half of it asks whether it lives
constexpr std::chrono::seconds close_timeout{2};
// Text waiting for a slow peer; beyond it nothing more is read from it.
constexpr std::size_t waiting_text_bytes_max = std::size_t{256} * 1024;
// Bytes on the wire for one message: its text, its frames' headers, pings in between.
constexpr std::size_t wire_bytes_max = 2 * limits::message_bytes_max;
constexpr std::chrono::seconds message_timeout{10};  // from its first byte

session::Micros now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch())
      .count();
}

bool offers_protocol(const UpgradeRequest& request) {
  for (const auto& field : request) {
    if (field.name() != beast::http::field::sec_websocket_protocol) continue;
    for (const std::string_view name : split_list(field.value(), ',')) {
      if (name == protocol::protocol_name) return true;
    }
  }
  return false;
}

class WebSocketSession : public Connection, public std::enable_shared_from_this<WebSocketSession> {
 private:
  template <class Body>
  auto handler(Body body) {
    return guarded(shared_from_this(), std::move(body));
  }

  // A callback that may come on any thread, and after the session has gone. The renderer must not
  // be the last to hold the session: it knows it weakly and the io thread looks whether it lives.
  template <class Body>
  auto back(Body body) {
    return [weak = weak_from_this(), executor = socket_.get_executor(), body](auto number,
                                                                              auto result) {
      asio::post(executor, [weak, body, number, result = std::move(result)]() mutable {
        const auto self = weak.lock();
        if (!self || self->ended_) return;
        guarded(self, [&] { body(*self, number, std::move(result)); })();
      });
    };
  }

 public:
  WebSocketSession(TcpStream stream, UpgradeRequest request, Services& services,
                   Connections& connections)
      : socket_(std::move(stream)),
        request_(std::move(request)),
        services_(services),
        connections_(connections),
        id_(connections.next_id()),
        session_timer_(socket_.get_executor()),
        write_timer_(socket_.get_executor()),
        message_timer_(socket_.get_executor()),
        viewer_(services, id_),
        session_(
            session_options(services.options),
            [&services](const protocol::View& view) { return services.catalogue.check(view); },
            now_us()) {}
  ~WebSocketSession() override { connections_.remove(id_); }
  WebSocketSession(const WebSocketSession&) = delete;
  WebSocketSession& operator=(const WebSocketSession&) = delete;

  void start() {
    full_ = connections_.streams() >= static_cast<std::size_t>(services_.options.sessions_max);
    connections_.add(id_, weak_from_this(), !full_);
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = handshake_timeout;
    timeout.idle_timeout = silence_timeout;
    timeout.keep_alive_pings = true;
    socket_.set_option(timeout);
    const bool named = offers_protocol(request_);
    socket_.set_option(
        websocket::stream_base::decorator([named](websocket::response_type& response) {
          response.set(beast::http::field::server, "windsplat");
          if (named) {
            response.set(beast::http::field::sec_websocket_protocol, protocol::protocol_name);
          }
        }));
    socket_.read_message_max(limits::message_bytes_max);
    socket_.auto_fragment(false);  // a frame is one WebSocket frame, its payload sent where it lies
    socket_.control_callback([this](websocket::frame_type, beast::string_view) { heard_whole(); });
    socket_.async_accept(request_, handler([this](ErrorCode fault) {
                           if (fault) return abort();
                           on_open();
                         }));
  }

  void drain() override {
    if (open_) apply(session_.on_drain(now_us()));
  }

  void abort() override {
    ended_ = true;
    open_ = false;
    viewer_.cancel_all();
    session_timer_.cancel();
    write_timer_.cancel();
    message_timer_.cancel();
    beast::get_lowest_layer(socket_).close();
  }

 private:
  struct Frame {
    std::array<std::uint8_t, protocol::frame_header_bytes> header;
    session::Payload payload;
  };

  static session::Options session_options(const ServerOptions& options) {
    session::Options out;
    out.idle_timeout_us = session::Micros{options.idle_timeout_s} * 1'000'000;
    return out;
  }

  void on_open() {
    open_ = true;
    if (full_) return close(close_full, "the server is full");
    if (services_.draining) return drain();
    const auto datasets = services_.catalogue.list();
    if (!datasets) return close(close_fault, "the datasets cannot be listed");
    send(protocol::HelloMessage{WINDSPLAT_VERSION, "session-" + std::to_string(id_), *datasets});
    log::info("viewer came", {{"session", id_}});
    heard_whole();
    read();
    schedule();
  }

  // --- reading ----------------------------------------------------------------------------------

  void read() {
    reading_ = true;
    socket_.async_read(buffer_, handler([this](ErrorCode fault, std::size_t) {
                         reading_ = false;
                         if (ended_) return;
                         if (fault) return end();
                         heard_whole();
                         on_text();
                         buffer_.consume(buffer_.size());
                         // Once closing, what still comes is read only to find the peer's close.
                         read_on();
                       }));
    watch_message();
  }

  void read_on() {
    if (reading_ || ended_ || waiting_text_bytes_ > waiting_text_bytes_max) return;
    read();
  }

  void on_text() {
    if (!open_) return;
    if (!socket_.got_text()) return apply(session_.on_binary(now_us()));
    const std::string text = beast::buffers_to_string(buffer_.data());
    const auto message = protocol::parse_client_message(text);
    if (message) return apply(session_.on_message(*message, now_us()));
    apply(session_.on_refused(message.error(), protocol::message_tag(text), now_us()));
  }

  void heard_whole() {
    beast::get_lowest_layer(socket_).rate_policy().forget();
    message_since_.reset();
  }

  // The layer above tells nothing of a message that never ends, in fragments of no length or byte
  // by byte: look at what came over the wire since the last whole one.
  void watch_message() {
    if (watching_) return;
    watching_ = true;
    message_timer_.expires_after(std::chrono::seconds(1));
    message_timer_.async_wait(handler([this](ErrorCode fault) {
      watching_ = false;
      if (fault || ended_) return;
      const std::size_t bytes = beast::get_lowest_layer(socket_).rate_policy().bytes_read();
      if (bytes > 0 && !message_since_) message_since_ = Clock::now();
      if (message_since_ && Clock::now() - *message_since_ > message_timeout) return abort();
      if (bytes > wire_bytes_max) return close(close_too_big, "a message has no end");
      watch_message();
    }));
  }

  // --- the session ------------------------------------------------------------------------------

  void apply(session::Effects effects) {
    for (session::Effect& effect : effects) {
      std::visit([this](auto& body) { carry_out(body); }, effect);
    }
    pump();
    schedule();
  }

  void carry_out(session::SendText& effect) { send(effect.message); }

  void carry_out(session::SendFrame& effect) {
    frame_ = Frame{protocol::encode_frame_header(effect.header), std::move(effect.payload)};
  }

  void carry_out(session::Close& effect) { close(effect.code, effect.reason); }

  void carry_out(session::CancelRender& effect) { viewer_.cancel(effect.ticket); }

  void carry_out(session::StartRender& effect) {
    viewer_.start(effect, back([](WebSocketSession& self, std::uint64_t ticket,
                                  Result<session::Drawn> drawn) {
                    self.viewer_.done(ticket);
                    self.apply(self.session_.on_rendered(ticket, std::move(drawn), now_us()));
                  }));
  }

  void carry_out(session::Describe& effect) {
    viewer_.start(effect, back([](WebSocketSession& self, std::uint32_t id,
                                  Result<protocol::DatasetDescription> description) {
                    self.apply(self.session_.on_described(id, std::move(description), now_us()));
                  }));
  }

  void schedule() {
    const auto wake = session_.wake_at();
    if (!open_ || !wake) return;
    session_timer_.expires_at(Clock::time_point(std::chrono::microseconds(*wake)));
    session_timer_.async_wait(handler([this](ErrorCode fault) {
      if (fault || !open_) return;
      apply(session_.on_time(now_us()));
    }));
  }

  // --- writing ----------------------------------------------------------------------------------

  void send(const protocol::ServerMessage& message) {
    texts_.push_back(protocol::encode(message));
    waiting_text_bytes_ += texts_.back().size();
    pump();
  }

  void pump() {
    if (writing_ || !open_) return;
    if (!texts_.empty()) {
      const std::string& text = texts_.front();
      write(asio::buffer(text), text.size(), true);
    } else if (frame_) {
      const std::array<asio::const_buffer, 2> parts{
          asio::buffer(frame_->header),
          asio::buffer(frame_->payload->data(), frame_->payload->size())};
      write(parts, frame_->header.size() + frame_->payload->size(), false);
    }
  }

  template <class Buffers>
  void write(const Buffers& buffers, std::size_t bytes, bool is_text) {
    writing_ = true;
    write_timer_.expires_after(write_deadline(bytes, limits::write_timeout_s));
    write_timer_.async_wait(handler([this](ErrorCode fault) {
      if (fault || !writing_) return;
      log::info("viewer too slow", {{"session", id_}});
      abort();
    }));
    socket_.text(is_text);
    socket_.async_write(buffers, handler([this, is_text](ErrorCode fault, std::size_t) {
                          writing_ = false;
                          write_timer_.cancel();
                          if (ended_) return;
                          if (fault) return end();
                          on_written(is_text);
                        }));
  }

  void on_written(bool is_text) {
    if (is_text) {
      waiting_text_bytes_ -= texts_.front().size();
      texts_.pop_front();
      pump();
      read_on();
    } else {
      frame_.reset();
      apply(session_.on_written(now_us()));
    }
  }

  // --- ends -------------------------------------------------------------------------------------

  // Says goodbye, within a limit of time; texts that wait are not sent any more.
  void close(int code, const std::string& reason) {
    if (!open_) return;
    open_ = false;
    viewer_.cancel_all();
    message_timer_.cancel();
    session_timer_.expires_after(close_timeout);
    session_timer_.async_wait(handler([this](ErrorCode fault) {
      if (!fault) abort();
    }));
    log::info("viewer is sent away", {{"session", id_}, {"code", code}, {"reason", reason}});
    const websocket::close_reason goodbye(static_cast<websocket::close_code>(code), reason);
    socket_.async_close(goodbye, handler([this](ErrorCode) { abort(); }));
  }

  void end() {
    if (open_) log::info("viewer went", {{"session", id_}});
    abort();
  }

  websocket::stream<TcpStream> socket_;
  UpgradeRequest request_;
  Services& services_;
  Connections& connections_;
  const std::uint64_t id_;
  asio::steady_timer session_timer_;
  asio::steady_timer write_timer_;
  asio::steady_timer message_timer_;
  Viewer viewer_;
  session::Session session_;
  beast::flat_buffer buffer_{limits::message_bytes_max + 1024};
  std::optional<Clock::time_point> message_since_;  // bytes came of a message not yet whole
  std::deque<std::string> texts_;
  std::size_t waiting_text_bytes_ = 0;
  std::optional<Frame> frame_;  // the session gives the next one when this is written
  bool full_ = false;
  bool open_ = false;   // accepted, and not closing
  bool ended_ = false;  // the connection is gone
  bool reading_ = false;
  bool writing_ = false;
  bool watching_ = false;
};

}  // namespace

void start_websocket_session(TcpStream stream, UpgradeRequest request, Services& services,
                             Connections& connections) {
  std::make_shared<WebSocketSession>(std::move(stream), std::move(request), services, connections)
      ->start();
}

}  // namespace windsplat::net
