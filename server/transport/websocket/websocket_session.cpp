// The WebSocket of a session from its handshake to its end. All on the io thread.
#include "server/transport/websocket/websocket_session.hpp"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "protocol/limits.hpp"
#include "server/api/routes.hpp"
#include "server/http/exchange.hpp"
#include "server/http/request_id.hpp"
#include "server/session/session.hpp"
#include "server/transport/websocket/session_driver.hpp"
#include "server/transport/websocket/stream_owner.hpp"
#include "server/transport/websocket/websocket_reader.hpp"
#include "server/transport/websocket/websocket_stream.hpp"

namespace windsplat::transport {
namespace {

constexpr std::chrono::seconds handshake_timeout{5};
constexpr std::chrono::seconds silence_timeout{60};  // a ping is sent after half of it
constexpr std::chrono::seconds close_timeout{2};

bool offers_protocol(const UpgradeRequest& request) {
  for (const auto& field : request) {
    if (field.name() != beast::http::field::sec_websocket_protocol) continue;
    for (const std::string_view name : http::split_list(field.value(), ',')) {
      if (name == protocol::protocol_name) return true;
    }
  }
  return false;
}

std::optional<session::Reading> what_is_read(const tasks::Catalogue& catalogue,
                                             const std::string& id) {
  const auto dataset = catalogue.find(id);
  const auto loading = dataset ? (*dataset)->loading() : std::nullopt;
  if (!loading) return std::nullopt;
  return session::Reading{loading->field, loading->done};
}

// Of method `kernel`: slabs and their number do not depend on the samples.
double time_by_work(tasks::Backend& backend, protocol::View view) {
  view.method.name = protocol::MethodName::kernel;
  const auto checked = backend.check(view);
  if (!checked) return 0;
  return backend.request_times.estimate_ms(view.dataset, view.method.name, checked->cost.kernels);
}

session::Session new_session(const api::ServerOptions& server_options, tasks::Backend& backend) {
  session::Options options;
  options.idle_timeout_us = session::Micros{server_options.idle_timeout_s} * 1'000'000;
  options.video = backend.video.available();
  return {
      options,
      {[&backend](const protocol::View& view) -> Result<int> {
         const auto checked = backend.check(view);
         if (!checked) return checked.error();
         return checked->steps;
       },
       [&backend](const std::string& id) { return what_is_read(backend.catalogue, id); },
       [&backend](const quality::SceneSignature& signature, const quality::Viewpoint& viewpoint) {
         return backend.quality.forecasts(signature, viewpoint);
       },
       [&backend] { return session::Micros{backend.renderer.stream_wait_us()}; },
       [&backend](const quality::SceneSignature& signature) {
         return backend.quality.begin_try(signature);
       },
       [&backend](const protocol::View& view) { return time_by_work(backend, view); }},
      now_us()};
}

class WebSocketSession final : public Connection, public StreamOwner {
 public:
  WebSocketSession(const StreamContext& context, Wire wire, std::string request_id, Guest guest)
      : StreamOwner(context.connections.next_id(), std::move(request_id)),
        socket_(std::move(wire)),
        context_(context),
        guest_(std::move(guest)),
        token_(context.options.token),
        close_timer_(socket_.get_executor()),
        driver_(*this, socket_, new_session(context.options, context.backend), context.backend,
                context.backend.metrics, context.admission, guest_.address,
                context.options.base_path),
        reader_(*this, socket_, context.admission, guest_.address, driver_.queue(), driver_) {}
  ~WebSocketSession() override { context_.connections.remove(id_); }
  WebSocketSession(const WebSocketSession&) = delete;
  WebSocketSession& operator=(const WebSocketSession&) = delete;

  void start(const UpgradeRequest& request) {
    const bool full =
        context_.connections.streams() >= static_cast<std::size_t>(context_.options.sessions_max);
    context_.connections.add(id_, std::static_pointer_cast<WebSocketSession>(shared_from_this()),
                             !full);
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = handshake_timeout;
    timeout.idle_timeout = silence_timeout;
    timeout.keep_alive_pings = true;
    socket_.set_option(timeout);
    const bool named = offers_protocol(request);
    socket_.set_option(websocket::stream_base::decorator(
        [named, id = request_id_](websocket::response_type& response) {
          response.set(http::request_id_header, id);
          response.set(beast::http::field::server, "windsplat");
          if (named) {
            response.set(beast::http::field::sec_websocket_protocol, protocol::protocol_name);
          }
        }));
    socket_.auto_fragment(false);  // one WebSocket frame per picture, without copying the payload
    reader_.prepare();
    // The request is used only while the response is composed, within this call.
    socket_.async_accept(request, handler([this, full](ErrorCode fault) {
                           if (fault) return abort();
                           on_open(full);
                         }));
  }

  void drain() override {
    if (open_) driver_.drain();
  }

  void on_changed(const std::string& dataset) override {
    if (open_) driver_.on_changed(dataset);
  }

  void on_new_token() override { close(close_policy, "the token has changed"); }

  void abort() override {
    ended_ = true;
    open_ = false;
    driver_.abort();
    reader_.stop();
    close_timer_.cancel();
    beast::get_lowest_layer(socket_).close();
  }

  void close(int code, const std::string& reason) override {
    if (!open_) return;
    open_ = false;
    driver_.stop();
    reader_.stop();
    close_timer_.expires_after(close_timeout);
    close_timer_.async_wait(handler([this](ErrorCode fault) {
      if (!fault) abort();
    }));
    log::info("closing session",
              {{"session", id_}, {"request", request_id_}, {"code", code}, {"reason", reason}});
    const websocket::close_reason goodbye(static_cast<websocket::close_code>(code), reason);
    socket_.async_close(goodbye, handler([this](ErrorCode) { abort(); }));
  }

  void on_disconnected() override {
    if (open_) log::info("session disconnected", {{"session", id_}, {"request", request_id_}});
    abort();
  }

  void on_text_written() override { reader_.resume(); }

 private:
  void on_open(bool full) {
    open_ = true;
    if (access::is_other_token(token_.get(), context_.options.token.get())) return on_new_token();
    context_.backend.metrics.answered(api::route_stream, 101);
    if (full) {
      context_.backend.metrics.refused(metrics::LimitKind::sessions);
      return close(close_full, "the server is full");
    }
    if (context_.draining) return drain();
    const auto datasets = context_.backend.catalogue.list();
    if (!datasets) return close(close_fault, "cannot list the datasets");
    driver_.begin({WINDSPLAT_VERSION, "session-" + std::to_string(id_), *datasets,
                   context_.options.published_limits()});
    log::info("session opened",
              {{"session", id_}, {"request", request_id_}, {"client", guest_.address}});
    reader_.start();
  }

  WebSocketStream socket_;
  const StreamContext& context_;
  const Guest guest_;
  const std::shared_ptr<const access::Token> token_;  // digest of the token that authorised it
  asio::steady_timer close_timer_;
  SessionDriver driver_;
  WebSocketReader reader_;
};

}  // namespace

void start_websocket_session(const StreamContext& context, Wire wire, const UpgradeRequest& request,
                             std::string request_id, Guest guest) {
  std::make_shared<WebSocketSession>(context, std::move(wire), std::move(request_id),
                                     std::move(guest))
      ->start(request);
}

}  // namespace windsplat::transport
