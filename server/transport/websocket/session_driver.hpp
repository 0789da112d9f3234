// Drives the state machine of a session: messages, results and times in; carries out its effects.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <string>
#include <string_view>

#include "server/metrics/metrics.hpp"
#include "server/session/session.hpp"
#include "server/transport/websocket/session_work.hpp"
#include "server/transport/websocket/stream_events.hpp"
#include "server/transport/websocket/stream_owner.hpp"
#include "server/transport/websocket/websocket_writer.hpp"

namespace windsplat::transport {

class SessionDriver final : public StreamEvents {
 public:
  // `address` is charged with the work and the bytes sent. `base_path` outlives the session.
  SessionDriver(StreamOwner& owner, WebSocketStream& socket, session::Session session,
                tasks::Backend& backend, metrics::Metrics& metrics, access::Admission& admission,
                const std::string& address, const std::string& base_path);
  ~SessionDriver() override;

  void begin(const protocol::HelloMessage& hello);
  void drain();
  void on_changed(const std::string& dataset);
  void stop();   // cancels its work
  void abort();  // nothing more can be written either
  [[nodiscard]] const WriteQueue& queue() const { return writer_.queue(); }

  void on_text(const std::string& text) override;
  void on_binary() override;
  void on_pong(std::string_view payload) override;
  void on_frame_written() override;
  [[nodiscard]] bool has_lost_reply() const override { return work_.has_lost_reply(); }

 private:
  void apply(session::Effects effects);
  void count_lost();
  void schedule();

  StreamOwner& owner_;
  const std::string& base_path_;
  metrics::Metrics& metrics_;
  WebSocketWriter writer_;
  SessionWork work_;
  session::Session session_;
  boost::asio::steady_timer timer_;
  std::uint64_t counted_dropped_ = 0;
  std::uint64_t counted_cancelled_ = 0;
  bool counted_ = false;  // whether it is counted as a session
};

}  // namespace windsplat::transport
