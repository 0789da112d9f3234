// The WebSocket transport: limits on size, rate and time of messages; carries out the effects of
// the session. All on the io thread.
#include "server/transport/websocket_session.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <charconv>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "protocol/codec.hpp"
#include "protocol/frame_header.hpp"
#include "protocol/limits.hpp"
#include "server/api/routes.hpp"
#include "server/api/services.hpp"
#include "server/http/exchange.hpp"
#include "server/session/session.hpp"
#include "server/transport/guarded.hpp"
#include "server/transport/post_or_retry.hpp"
#include "server/work/viewer.hpp"

namespace windsplat::net {
namespace {

namespace limits = protocol::limits;
namespace websocket = beast::websocket;
using Clock = std::chrono::steady_clock;

constexpr int close_policy = 1008;
constexpr int close_too_big = 1009;
constexpr int close_full = 1013;
constexpr int close_fault = 1011;
constexpr std::chrono::seconds handshake_timeout{5};
constexpr std::chrono::seconds silence_timeout{60};  // a ping is sent after half of it
constexpr std::chrono::seconds close_timeout{2};
constexpr std::chrono::seconds throttle_max{10};
// Limit of queued text for a slow peer; above it reading pauses.
constexpr std::size_t waiting_text_bytes_max = std::size_t{256} * 1024;
// Bytes on the wire for one message: text and frame headers.
constexpr std::size_t wire_bytes_max = 2 * limits::message_bytes_max;
constexpr int controls_a_second_max = 10000;         // pings and pongs
constexpr std::chrono::seconds message_timeout{10};  // from the first byte

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

std::optional<session::Reading> what_is_read(const Services& services, const std::string& id) {
  const auto dataset = services.backend.catalogue.find(id);
  const auto loading = dataset ? (*dataset)->loading() : std::nullopt;
  if (!loading) return std::nullopt;
  return session::Reading{loading->field, loading->done};
}

class WebSocketSession : public Connection, public std::enable_shared_from_this<WebSocketSession> {
 private:
  template <class Body>
  auto handler(Body body) {
    return guarded(shared_from_this(), std::move(body));
  }

  // A callback that may run on any thread and after the session ended. Holds the session weakly,
  // since the renderer must not destroy it; the io thread checks whether it still exists.
  template <class Body>
  auto back(Body body) {
    return [weak = weak_from_this(), executor = socket_.get_executor(), lost = answer_lost_, body](
               auto number, auto result) {
      const bool posted =
          post_or_retry(executor, [weak, body, number, result = std::move(result)]() mutable {
            const auto self = weak.lock();
            if (!self || self->ended_) return;
            guarded(self, [&] { body(*self, number, std::move(result)); })();
          });
      if (!posted) *lost = true;
    };
  }

 public:
  WebSocketSession(Wire wire, UpgradeRequest request, std::string request_id, Services& services,
                   Connections& connections, Guest guest)
      : socket_(std::move(wire)),
        request_(std::move(request)),
        request_id_(std::move(request_id)),
        services_(services),
        connections_(connections),
        id_(connections.next_id()),
        guest_(std::move(guest)),
        token_(services.options.token),
        pay_timer_(socket_.get_executor()),
        session_timer_(socket_.get_executor()),
        write_timer_(socket_.get_executor()),
        message_timer_(socket_.get_executor()),
        read_timer_(socket_.get_executor()),
        viewer_(services.backend, id_, guest_.address),
        session_(session_options(services.options),
                 {[&services](const protocol::View& view) -> Result<int> {
                    const auto checked = services.backend.check(view);
                    if (!checked) return checked.error();
                    return checked->steps;
                  },
                  [&services](const std::string& id) { return what_is_read(services, id); },
                  [&services](const quality::SceneSignature& signature,
                              const quality::Viewpoint& viewpoint) {
                    return services.backend.quality.forecasts(signature, viewpoint);
                  }},
                 now_us()) {}
  ~WebSocketSession() override {
    count_lost();
    hold(-held_bytes_);
    if (counted_) services_.metrics.session_closed();
    connections_.remove(id_);
  }
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
    socket_.set_option(websocket::stream_base::decorator(
        [named, id = request_id_](websocket::response_type& response) {
          response.set(request_id_header, id);
          response.set(beast::http::field::server, "windsplat");
          if (named) {
            response.set(beast::http::field::sec_websocket_protocol, protocol::protocol_name);
          }
        }));
    socket_.read_message_max(limits::message_bytes_max);
    socket_.auto_fragment(false);  // one WebSocket frame per picture, without copying the payload
    socket_.control_callback([this](websocket::frame_type kind, beast::string_view payload) {
      heard_control(payload.size());
      count_control();
      if (kind == websocket::frame_type::pong) on_pong(payload);
    });
    socket_.async_accept(request_, handler([this](ErrorCode fault) {
                           if (fault) return abort();
                           on_open();
                         }));
  }

  [[nodiscard]] const std::string& request_id() const { return request_id_; }

  void drain() override {
    if (open_) apply(session_.on_drain(now_us()));
  }

  void on_changed(const std::string& dataset) override {
    if (open_) apply(session_.on_changed(dataset, now_us()));
  }

  void on_new_token() override { close(close_policy, "the token has changed"); }

  void abort() override {
    ended_ = true;
    open_ = false;
    viewer_.cancel_all();
    session_timer_.cancel();
    pay_timer_.cancel();
    write_timer_.cancel();
    message_timer_.cancel();
    read_timer_.cancel();
    beast::get_lowest_layer(socket_).close();
  }

 private:
  struct Frame {
    std::array<std::uint8_t, protocol::frame_header_bytes> header;
    session::Payload payload;
    session::Tier tier;
    protocol::FrameHeader facts;
  };

  static session::Options session_options(const ServerOptions& options) {
    session::Options out;
    out.idle_timeout_us = session::Micros{options.idle_timeout_s} * 1'000'000;
    return out;
  }

  void on_open() {
    open_ = true;
    if (is_other_token(token_.get(), services_.options.token.get())) return on_new_token();
    services_.metrics.answered(route_stream, 101);
    if (full_) {
      services_.metrics.refused(LimitKind::sessions);
      return close(close_full, "the server is full");
    }
    if (services_.draining) return drain();
    const auto datasets = services_.backend.catalogue.list();
    if (!datasets) return close(close_fault, "cannot list the datasets");
    send(protocol::HelloMessage{WINDSPLAT_VERSION, "session-" + std::to_string(id_), *datasets,
                                services_.options.limits.pixels_max_reported()});
    counted_ = true;
    services_.metrics.session_opened();
    log::info("session opened", {{"session", id_}, {"request", request_id_}});
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
                         charge_message(buffer_.size());
                         buffer_.consume(buffer_.size());
                         // While closing, the close operation itself reads until the peer's close:
                         // a further read would deadlock with it.
                         read_on();
                       }));
    watch_message();
  }

  void read_on() {
    if (reading_ || !open_ || owes_reading_ || waiting_text_bytes_ > waiting_text_bytes_max) return;
    read();
  }

  // Pauses reading from an address above its rate until it is within the limit.
  void charge_message(std::size_t bytes) {
    const std::chrono::microseconds wait(
        services_.admission.message_received(guest_.address, bytes));
    if (wait.count() == 0 || !open_) return;
    owes_reading_ = true;
    read_timer_.expires_after(wait);
    read_timer_.async_wait(handler([this](ErrorCode /*fault*/) {
      owes_reading_ = false;
      read_on();
    }));
  }

  // Pings are handled within a read, which cannot be paused: too many close the connection.
  void count_control() {
    if (++controls_ != controls_a_second_max) return;
    asio::post(socket_.get_executor(), handler([this] { close(close_policy, "too many pings"); }));
  }

  void on_text() {
    if (!open_) return;
    if (!socket_.got_text()) return apply(session_.on_binary(now_us()));
    const std::string text = beast::buffers_to_string(buffer_.data());
    const auto message = protocol::parse_client_message(text);
    if (message) return apply(session_.on_message(*message, now_us()));
    apply(session_.on_refused(message.error(), protocol::message_tag(text), now_us()));
  }

  // Ignore pongs that do not acknowledge a frame.
  void on_pong(beast::string_view payload) {
    std::uint32_t seq = 0;
    const char* const end = payload.data() + payload.size();
    const auto read = std::from_chars(payload.data(), end, seq);
    if (read.ec == std::errc() && read.ptr == end) session_.on_pong(seq, now_us());
  }

  void heard_whole() {
    socket_.next_layer().forget();
    control_bytes_ = 0;
    message_since_.reset();
  }

  // The control frame may have arrived between fragments of a message. Some of its bytes may have
  // been read, and discounted, with the previous message.
  void heard_control(std::size_t payload_bytes) {
    constexpr std::size_t head_bytes = 6;  // header with mask
    control_bytes_ =
        std::min(control_bytes_ + head_bytes + payload_bytes, socket_.next_layer().bytes_read());
  }

  // The WebSocket layer reports nothing of a message that never ends, sent as empty fragments or
  // byte by byte: count the bytes since the last complete message, less control frames.
  void watch_message() {
    if (watching_) return;
    watching_ = true;
    message_timer_.expires_after(std::chrono::seconds(1));
    message_timer_.async_wait(handler([this](ErrorCode fault) {
      watching_ = false;
      controls_ = 0;
      if (fault || ended_) return;
      if (*answer_lost_) return end_failed(*this, "a reply was lost");
      const std::size_t bytes = socket_.next_layer().bytes_read() - control_bytes_;
      if (bytes == 0) message_since_.reset();
      if (bytes > 0 && !message_since_) message_since_ = Clock::now();
      if (message_since_ && Clock::now() - *message_since_ > message_timeout) return abort();
      if (bytes > wire_bytes_max) return close(close_too_big, "the message is too long");
      watch_message();
    }));
  }

  // --- the session ------------------------------------------------------------------------------

  void apply(session::Effects effects) {
    for (session::Effect& effect : effects) {
      std::visit([this](auto& body) { carry_out(body); }, effect);
    }
    count_lost();
    pump();
    schedule();
  }

  void count_lost() {
    const protocol::StatsMessage& stats = session_.stats();
    services_.metrics.frames_dropped(stats.dropped - counted_dropped_);
    services_.metrics.renders_cancelled(stats.cancelled - counted_cancelled_);
    counted_dropped_ = stats.dropped;
    counted_cancelled_ = stats.cancelled;
  }

  void carry_out(session::SendText& effect) { send(effect.message); }

  void carry_out(session::SendFrame& effect) {
    frame_ = Frame{protocol::encode_frame_header(effect.header), std::move(effect.payload),
                   effect.tier, effect.header};
    hold(frame_bytes());
  }

  // Sent by the layer below before the next write.
  void carry_out(session::Ping& effect) {
    if (pinging_ || !open_) return;
    pinging_ = true;
    const std::string text = std::to_string(effect.seq);
    socket_.async_ping(websocket::ping_data(text.data(), text.size()),
                       handler([this](ErrorCode /*fault*/) { pinging_ = false; }));
  }

  void carry_out(session::Close& effect) { close(effect.code, effect.reason); }

  void carry_out(session::CancelRender& effect) {
    if (throttled_ && throttled_->ticket == effect.ticket) begin_throttled();  // to be answered
    viewer_.cancel(effect.ticket);
  }

  void carry_out(session::Prefetch& effect) { viewer_.start(effect); }

  void carry_out(session::Calibrate& effect) { viewer_.start(effect); }

  // A throttled address gets its frames later; a long delay closes the session.
  void carry_out(session::StartRender& effect) {
    const std::chrono::microseconds wait(services_.admission.throttle_delay(guest_.address));
    if (wait.count() == 0) return begin(effect);
    if (wait > throttle_max) {
      return close(close_full, "this address exceeded its quota; try again in " +
                                   std::to_string(wait / std::chrono::seconds(1)) + " s");
    }
    throttled_ = effect;
    pay_timer_.expires_after(wait);
    pay_timer_.async_wait(handler([this](ErrorCode fault) {
      if (!fault && throttled_) begin_throttled();
    }));
  }

  void begin_throttled() {
    const auto effect = std::exchange(throttled_, std::nullopt);
    if (open_) begin(*effect);
  }

  void begin(const session::StartRender& effect) {
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
    hold(static_cast<std::int64_t>(texts_.back().size()));
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
    written_since_ = now_us();
    write_timer_.expires_after(write_deadline(bytes, limits::write_timeout_s));
    write_timer_.async_wait(handler([this](ErrorCode fault) {
      // The timer may expire just as the last write ends.
      if (fault || !writing_ || write_timer_.expiry() > Clock::now()) return;
      log::info("closing session: client too slow", {{"session", id_}, {"request", request_id_}});
      abort();
    }));
    socket_.text(is_text);
    socket_.async_write(buffers, handler([this, is_text](ErrorCode fault, std::size_t bytes) {
                          writing_ = false;
                          services_.metrics.bytes_sent(Metrics::Over::stream, bytes);
                          services_.admission.sent(guest_.address, bytes);
                          write_timer_.cancel();
                          if (ended_) return;
                          if (fault) return end();
                          on_written(is_text);
                        }));
  }

  void on_written(bool is_text) {
    if (is_text) {
      waiting_text_bytes_ -= texts_.front().size();
      hold(-static_cast<std::int64_t>(texts_.front().size()));
      texts_.pop_front();
      pump();
      read_on();
    } else {
      services_.metrics.stage_took(Metrics::Stage::write, now_us() - written_since_);
      services_.metrics.frame_sent(frame_->tier, frame_->facts);
      hold(-frame_bytes());
      frame_.reset();
      apply(session_.on_written(now_us()));
    }
  }

  [[nodiscard]] std::int64_t frame_bytes() const {
    return static_cast<std::int64_t>(frame_->header.size() + frame_->payload->size());
  }

  void hold(std::int64_t more_bytes) {
    held_bytes_ += more_bytes;
    services_.metrics.unsent(more_bytes);
  }

  // --- ends -------------------------------------------------------------------------------------

  // Closes with a time limit; queued texts are dropped.
  void close(int code, const std::string& reason) {
    if (!open_) return;
    open_ = false;
    viewer_.cancel_all();
    message_timer_.cancel();
    session_timer_.expires_after(close_timeout);
    session_timer_.async_wait(handler([this](ErrorCode fault) {
      if (!fault) abort();
    }));
    log::info("closing session",
              {{"session", id_}, {"request", request_id_}, {"code", code}, {"reason", reason}});
    const websocket::close_reason goodbye(static_cast<websocket::close_code>(code), reason);
    socket_.async_close(goodbye, handler([this](ErrorCode) { abort(); }));
  }

  void end() {
    if (open_) log::info("session disconnected", {{"session", id_}, {"request", request_id_}});
    abort();
  }

  websocket::stream<Wire> socket_;
  UpgradeRequest request_;
  const std::string request_id_;
  Services& services_;
  Connections& connections_;
  const std::uint64_t id_;
  const Guest guest_;
  const std::shared_ptr<const Token> token_;  // token that authorised it
  asio::steady_timer pay_timer_;
  asio::steady_timer session_timer_;
  asio::steady_timer write_timer_;
  asio::steady_timer message_timer_;
  asio::steady_timer read_timer_;  // until the message quota allows reading
  Viewer viewer_;
  session::Session session_;
  beast::flat_buffer buffer_{limits::message_bytes_max + 1024};
  std::size_t control_bytes_ = 0;                   // control frames since the last message
  std::optional<Clock::time_point> message_since_;  // first bytes of an incomplete message
  std::deque<std::string> texts_;
  std::size_t waiting_text_bytes_ = 0;
  std::optional<session::StartRender> throttled_;  // starts when pay_timer_ expires
  std::optional<Frame> frame_;  // the session provides the next one after the write
  session::Micros written_since_ = 0;
  std::int64_t held_bytes_ = 0;  // of texts_ and frame_
  std::uint64_t counted_dropped_ = 0;
  std::uint64_t counted_cancelled_ = 0;
  bool counted_ = false;  // counted as a session
  // A reply could not be posted to the io thread.
  const std::shared_ptr<std::atomic<bool>> answer_lost_ =
      std::make_shared<std::atomic<bool>>(false);
  bool owes_reading_ = false;
  int controls_ = 0;  // since the last watch_message()
  bool full_ = false;
  bool open_ = false;   // accepted, and not closing
  bool ended_ = false;  // disconnected
  bool reading_ = false;
  bool writing_ = false;
  bool pinging_ = false;
  bool watching_ = false;
};

}  // namespace

void start_websocket_session(Wire wire, UpgradeRequest request, std::string request_id,
                             Services& services, Connections& connections, Guest guest) {
  std::make_shared<WebSocketSession>(std::move(wire), std::move(request), std::move(request_id),
                                     services, connections, std::move(guest))
      ->start();
}

}  // namespace windsplat::net
