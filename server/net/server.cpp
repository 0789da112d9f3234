// Puts the network side together: one io thread, one renderer, and an orderly end.
#include "server/net/server.hpp"

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <exception>
#include <utility>

#include "server/base/check.hpp"
#include "server/base/log.hpp"
#include "server/net/connections.hpp"
#include "server/net/http_session.hpp"
#include "server/net/listener.hpp"
#include "server/net/router.hpp"

namespace windsplat::net {
namespace {

namespace asio = boost::asio;

// Beside the streams: requests, and viewers that are told that the server is full.
constexpr std::size_t other_connections_max = 256;
constexpr std::chrono::seconds drain_cancel_after{6};
constexpr std::chrono::seconds drain_abort_after{8};

}  // namespace

struct Server::State {
  State(ServerOptions options, std::shared_ptr<data::Store> store, std::shared_ptr<ThreadPool> pool)
      : connections_max(static_cast<std::size_t>(options.sessions_max) + other_connections_max),
        listener(io, [this](asio::ip::tcp::socket socket) { accepted(std::move(socket)); }),
        cancel_timer(io),
        abort_timer(io),
        services(std::move(options), std::move(store), std::move(pool)) {
    connections.on_empty([this] {
      if (services.draining) end();
    });
  }

  ~State() {
    connections.on_empty(nullptr);
    for (const auto& connection : connections.all()) connection->abort();
    services.renderer.cancel_all();
  }

  void accepted(asio::ip::tcp::socket socket) {
    if (connections.size() >= connections_max) return;  // closed unanswered
    start_http_session(std::move(socket), services, connections);
  }

  // On the io thread.
  void begin_drain() {
    if (services.draining.exchange(true)) return;
    for (const auto& connection : connections.all()) connection->drain();
    cancel_timer.expires_after(drain_cancel_after);
    cancel_timer.async_wait([this](boost::system::error_code fault) {
      if (!fault) services.renderer.cancel_all();
    });
    abort_timer.expires_after(drain_abort_after);
    abort_timer.async_wait([this](boost::system::error_code fault) {
      if (fault) return;
      for (const auto& connection : connections.all()) connection->abort();
      end();
    });
    if (connections.size() == 0) end();
  }

  void end() {
    listener.close();
    cancel_timer.cancel();
    abort_timer.cancel();
    asio::post(io, [this] { io.stop(); });
  }

  Connections connections;  // before io: sessions left in it take their leave here
  asio::io_context io{1};
  const std::size_t connections_max;
  Listener listener;
  asio::steady_timer cancel_timer;
  asio::steady_timer abort_timer;
  Services services;  // last: its renderer posts to io and ends first
};

Server::Server(ServerOptions options, std::shared_ptr<data::Store> store,
               std::shared_ptr<ThreadPool> pool)
    : state_(std::make_unique<State>(std::move(options), std::move(store), std::move(pool))) {}

Server::~Server() = default;

Result<void> Server::listen() {
  const ServerOptions& options = state_->services.options;
  return state_->listener.listen(options.address, options.port);
}

std::uint16_t Server::port() const { return state_->listener.endpoint().port(); }

std::string Server::url() const {
  auto address = state_->listener.endpoint().address();
  std::string host = address.to_string();
  if (address.is_unspecified()) {
    host = "127.0.0.1";  // every address of this machine, so this one too
  } else if (address.is_v6()) {
    host = '[' + host + ']';
  }
  return "http://" + host + ':' + std::to_string(port()) + state_->services.options.base_path;
}

void Server::run() {
  WINDSPLAT_CHECK(port() != 0);
  state_->listener.start();
  while (!state_->io.stopped()) {
    try {
      state_->io.run();
    } catch (const std::exception& fault) {
      log::error("a fault reached the io loop", {{"fault", fault.what()}});
    }
  }
}

void Server::drain() {
  asio::post(state_->io, [state = state_.get()] { state->begin_drain(); });
}

}  // namespace windsplat::net
