#include "server/transport/websocket/session_driver.hpp"

#include <charconv>
#include <chrono>
#include <utility>
#include <variant>

#include "protocol/codec.hpp"
#include "protocol/problems/problem_types.hpp"

namespace windsplat::transport {
namespace {

struct EffectRunner {
  StreamOwner& owner;
  WebSocketWriter& writer;
  SessionWork& work;
  const std::string& base_path;

  void operator()(session::SendText& effect) const {
    if (auto* const error = std::get_if<protocol::ErrorMessage>(&effect.message)) {
      error->problem.type = protocol::resolved_type(base_path, error->problem.type);
    }
    writer.send(effect.message);
  }
  void operator()(session::SendFrame& effect) const { writer.queue_frame(std::move(effect)); }
  void operator()(session::Ping& effect) const { writer.ping(effect.seq); }
  void operator()(session::Close& effect) const { owner.close(effect.code, effect.reason); }
  void operator()(session::CancelRender& effect) const { work.cancel(effect.ticket); }
  template <class Work>
  void operator()(Work& effect) const {
    work.start(effect);
  }
};

}  // namespace

SessionDriver::SessionDriver(StreamOwner& owner, WebSocketStream& socket, session::Session session,
                             tasks::Backend& backend, metrics::Metrics& metrics,
                             access::Admission& admission, const std::string& address,
                             const std::string& base_path)
    : owner_(owner),
      base_path_(base_path),
      metrics_(metrics),
      writer_(owner, socket, metrics, admission, address, *this),
      work_(
          owner, socket.get_executor(), backend, admission, address,
          [this](std::uint64_t ticket, Result<session::Drawn> drawn) {
            apply(session_.on_rendered(ticket, std::move(drawn), now_us()));
          },
          [this](std::uint32_t id, Result<protocol::DatasetDescription> description) {
            apply(session_.on_described(id, std::move(description), now_us()));
          }),
      session_(std::move(session)),
      timer_(socket.get_executor()) {}

SessionDriver::~SessionDriver() {
  count_lost();
  if (counted_) metrics_.session_closed();
}

void SessionDriver::begin(const protocol::HelloMessage& hello) {
  writer_.send(hello);
  counted_ = true;
  metrics_.session_opened();
  schedule();
}

void SessionDriver::drain() { apply(session_.on_drain(now_us())); }

void SessionDriver::on_changed(const std::string& dataset) {
  apply(session_.on_changed(dataset, now_us()));
}

void SessionDriver::stop() {
  work_.stop();
  timer_.cancel();
}

void SessionDriver::abort() {
  stop();
  writer_.stop();
}

void SessionDriver::on_text(const std::string& text) {
  const auto message = protocol::parse_client_message(text);
  if (message) return apply(session_.on_message(*message, now_us()));
  apply(session_.on_refused(message.error(), protocol::message_tag(text), now_us()));
}

void SessionDriver::on_binary() { apply(session_.on_binary(now_us())); }

// Ignore pongs that do not acknowledge a frame.
void SessionDriver::on_pong(std::string_view payload) {
  std::uint32_t seq = 0;
  const char* const end = payload.data() + payload.size();
  const auto read = std::from_chars(payload.data(), end, seq);
  if (read.ec == std::errc() && read.ptr == end) session_.on_pong(seq, now_us());
}

void SessionDriver::on_frame_written() { apply(session_.on_written(now_us())); }

void SessionDriver::apply(session::Effects effects) {
  const EffectRunner runner{owner_, writer_, work_, base_path_};
  for (session::Effect& effect : effects) std::visit(runner, effect);
  count_lost();
  writer_.pump();
  schedule();
}

void SessionDriver::count_lost() {
  const protocol::StatsMessage& stats = session_.stats();
  metrics_.frames_dropped(stats.dropped - counted_dropped_);
  metrics_.renders_cancelled(stats.cancelled - counted_cancelled_);
  counted_dropped_ = stats.dropped;
  counted_cancelled_ = stats.cancelled;
}

void SessionDriver::schedule() {
  const auto wake = session_.wake_at();
  if (!owner_.is_open() || !wake) return;
  timer_.expires_at(std::chrono::steady_clock::time_point(std::chrono::microseconds(*wake)));
  timer_.async_wait(owner_.handler([this](const boost::system::error_code& fault) {
    if (fault || !owner_.is_open()) return;
    apply(session_.on_time(now_us()));
  }));
}

}  // namespace windsplat::transport
