// Assembles the network side: one io thread, one renderer, and an orderly shutdown.
#include "server/transport/server.hpp"

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <ctime>
#include <exception>
#include <new>
#include <thread>
#include <utility>
#include <vector>

#include "server/base/check.hpp"
#include "server/base/log.hpp"
#include "server/tasks/run_guarded.hpp"
#include "server/transport/handshake.hpp"
#include "server/transport/listener.hpp"
#include "server/transport/peer.hpp"
#include "server/transport/post_or_retry.hpp"
#include "server/transport/server_parts.hpp"

namespace windsplat::transport {
namespace {

namespace asio = boost::asio;

constexpr std::chrono::seconds look_every{1};
// Delay before a retry after an allocation failure.
constexpr std::chrono::milliseconds after_a_fault{10};

}  // namespace

struct Server::State {
  State(api::ServerOptions options, std::shared_ptr<data::Store> store,
        std::shared_ptr<ThreadPool> pool)
      : parts(std::move(options), std::move(store), std::move(pool)),
        look_timer(io),
        alive_timer(io),
        cancel_timer(io),
        abort_timer(io) {
    parts.connections.on_empty([this] {
      if (parts.draining) end();
    });
  }

  ~State() {
    parts.connections.on_empty(nullptr);
    parts.connections.each([](Connection& connection) { connection.abort(); });
    parts.backend.renderer.cancel_all();
    if (ending.joinable()) ending.join();
    parts.backend.catalogue.store().end();  // ends reads, so that no executor blocks in one
    parts.end();                            // ends the threads of the executors
    if (handshakes) handshakes->stop();
    // Releases handlers that were pending when the loop stopped.
    io.restart();
    while (true) {
      try {
        io.poll();
        break;
      } catch (const std::exception& fault) {
        tasks::log_fault("an exception reached the io loop", fault);
      }
    }
  }

  // UNIX sockets are not encrypted: they do not leave the machine.
  void accepted(asio::generic::stream_protocol::socket socket, bool over_tcp) {
    const std::string address = peer_of(socket.native_handle());
    HandshakeThread* const tls = over_tcp ? handshakes.get() : nullptr;
    auto visitor = admit(address, tls != nullptr);
    if (!visitor) return parts.metrics.connection_refused();
    start_connection(parts.http, std::move(socket), tls, std::move(*visitor));
  }

  Result<void> listen() {
    for (const api::ListenPlace& place : parts.options.listen) {
      auto listener = std::make_unique<Listener>(
          io,
          [this, over_tcp = place.path.empty()](asio::generic::stream_protocol::socket socket) {
            accepted(std::move(socket), over_tcp);
          },
          [this] { parts.metrics.accept_failed(); });
      auto bound = listener->listen(place);
      if (bound) {
        listeners.push_back(std::move(listener));
      } else if (!place.may_lack || bound.error().kind != ErrorKind::not_found) {
        return bound;
      } else {
        log::warn("an address is left out", {{"fault", bound.error().message}});
      }
    }
    if (!listeners.empty()) return {};
    return make_error(ErrorKind::internal, "cannot listen: this machine has none of the addresses");
  }

  // Frees a slot by closing the connection that has been idle longest, or in the reserve the one
  // that has waited longest without a request.
  std::optional<access::Visitor> admit(const std::string& address, bool tls) {
    access::Admission& admission = parts.admission;
    if (!admission.arrive(address, tls)) return std::nullopt;
    auto visitor = admission.connect(address);
    const auto& reason = visitor ? visitor->reserve : std::nullopt;
    if (visitor && reason && reason->kind == metrics::LimitKind::connections &&
        parts.connections.end_longest(&Connection::idle_since)) {
      visitor.reset();
      visitor = admission.connect(address);
    }
    if (!visitor && admission.is_kept_out_by_others(address) &&
        parts.connections.end_longest(&Connection::unasked_since)) {
      visitor = admission.connect(address);
    }
    return visitor;
  }

  // Checks files every second, one check at a time; slow disks lower the rate.
  void check_data_files() {
    checking_files = false;
    look_timer.expires_after(look_every);
    look_timer.async_wait([this](boost::system::error_code fault) {
      checking_files = false;
      if (!fault) parts.admission.log_refused_handshakes();
      if (fault || parts.draining) return;
      const auto look = [this] {
        auto found = tasks::run_guarded<std::vector<std::string>>("file check", never, [this] {
          end_expired_uploads();
          parts.backend.animations.expire();
          return parts.backend.catalogue.look_after();
        });
        std::vector<std::string> changed;
        if (found) changed = std::move(*found);
        const auto go_on_looking = [this, changed = std::move(changed)] {
          checking_files = false;
          tell_changes(changed);
          check_data_files();
        };
        while (!post_or_retry(io.get_executor(), go_on_looking) && !parts.draining) {
        }
      };
      if (!parts.file_checks.submit({never, look})) return check_data_files();
      checking_files = true;
    });
    checking_files = true;
  }

  // With the datasets opened from them.
  void end_expired_uploads() {
    if (!parts.options.uploads) return;
    for (const std::string& dataset : parts.options.uploads->expire(std::time(nullptr))) {
      parts.backend.catalogue.forget(dataset);
    }
  }

  void tell_changes(const std::vector<std::string>& datasets) {
    for (const std::string& dataset : datasets) {
      parts.backend.quality.forget(dataset);
      parts.connections.each([&](Connection& connection) { connection.on_changed(dataset); });
    }
  }

  // The network thread works; the timer runs until the end of a drain.
  void tell_alive() {
    if (parts.options.alive_every.count() == 0) return;
    alive_timer.expires_after(parts.options.alive_every);
    alive_timer.async_wait([this](boost::system::error_code fault) {
      telling_alive = false;
      if (fault) return;
      parts.options.alive();
      tell_alive();
    });
    telling_alive = true;
  }

  // Periodic operations that schedule themselves; one that failed to allocate its next step is
  // restarted here.
  void go_on() {
    if (!telling_alive) tell_alive();
    if (parts.draining && !drain_timers_set) begin_drain();
    if (parts.draining) return;
    for (const auto& listener : listeners) listener->start();
    if (!checking_files) check_data_files();
  }

  // On the io thread.
  void change(Access access) {
    api::ServerOptions& options = parts.options;
    WINDSPLAT_CHECK((access.tls == nullptr) == (options.tls == nullptr));
    const bool other_token = access::is_other_token(options.token.get(), access.token.get());
    options.allow_origins = std::move(access.allow_origins);
    options.token = std::move(access.token);
    options.tls = std::move(access.tls);
    options.known_hosts_only = access.known_hosts_only;
    options.allow_hosts = std::move(access.allow_hosts);
    if (!other_token) return;
    parts.connections.each([](Connection& connection) {
      try {
        connection.on_new_token();
      } catch (const std::exception&) {
        connection.abort();  // authorised by the previous token
      }
    });
  }

  // On the io thread.
  void begin_drain() {
    parts.draining = true;
    if (drain_timers_set) return;
    cancel_timer.expires_after(parts.options.drain_cancel_after);
    cancel_timer.async_wait([this](boost::system::error_code fault) {
      if (fault) return;
      parts.backend.renderer.cancel_all();
      ending = std::thread([this] {
        try {
          parts.backend.catalogue.store().end();
        } catch (const std::exception& failure) {
          tasks::log_fault("pending reads could not be ended", failure);
        }
      });
    });
    abort_timer.expires_after(parts.options.drain_abort_after);
    abort_timer.async_wait([this](boost::system::error_code fault) {
      if (fault) return;
      parts.connections.each([](Connection& connection) { connection.abort(); });
      end();
    });
    drain_timers_set = true;
    parts.backend.jobs.cancel_all();
    parts.connections.each([](Connection& connection) {
      try {
        connection.drain();
      } catch (const std::exception&) {
        connection.abort();
      }
    });
    if (parts.connections.size() == 0) end();
  }

  void end() {
    for (const auto& listener : listeners) listener->close();
    parts.connections.each(
        [](Connection& connection) { connection.abort(); });  // accepted during the drain
    look_timer.cancel();
    alive_timer.cancel();
    cancel_timer.cancel();
    abort_timer.cancel();
    try {
      asio::post(io, [this] { io.stop(); });
    } catch (const std::bad_alloc&) {
      io.stop();
    }
  }

  // Before io: sessions left in its queue deregister when it is destroyed. Executors post to
  // io and end before it, in ~State.
  ServerParts parts;
  asio::io_context io{1};
  // The loop ends by stop() only, not when all pending operations failed to allocate.
  asio::executor_work_guard<asio::io_context::executor_type> work{io.get_executor()};
  // Null for plain TCP. Its thread also posts to io.
  const std::unique_ptr<HandshakeThread> handshakes{
      parts.options.tls ? std::make_unique<HandshakeThread>() : nullptr};
  std::vector<std::unique_ptr<Listener>> listeners;
  asio::steady_timer look_timer;
  asio::steady_timer alive_timer;
  asio::steady_timer cancel_timer;
  asio::steady_timer abort_timer;
  const CancelToken never;        // for work that cannot be cancelled
  bool checking_files = false;    // a file check is scheduled or running
  bool telling_alive = false;     // the next call of `alive` is scheduled
  bool drain_timers_set = false;  // the timers of a drain run
  std::thread ending;             // ends pending reads when a drain takes a long time
};

Server::Server(api::ServerOptions options, std::shared_ptr<data::Store> store,
               std::shared_ptr<ThreadPool> pool)
    : state_(std::make_unique<State>(std::move(options), std::move(store), std::move(pool))) {}

Server::~Server() = default;

Result<void> Server::listen() { return state_->listen(); }

std::uint16_t Server::port() const {
  for (const auto& listener : state_->listeners) {
    if (listener->port() != 0) return listener->port();
  }
  return 0;
}

std::string Server::url() const {
  const std::vector<std::string> all = urls();
  return all.empty() ? "" : all.front();
}

std::vector<std::string> Server::urls() const {
  const api::ServerOptions& options = state_->parts.options;
  std::vector<std::string> all;
  for (const auto& listener : state_->listeners) {
    all.push_back(listener->url(options.tls != nullptr, options.base_path));
  }
  return all;
}

void Server::run() {
  WINDSPLAT_CHECK(!state_->listeners.empty());
  while (!state_->io.stopped()) {
    try {
      state_->go_on();
      state_->io.run();
    } catch (const std::exception& fault) {
      tasks::log_fault("an exception reached the io loop", fault);
      std::this_thread::sleep_for(after_a_fault);
    }
  }
}

void Server::drain() {
  // A request to stop must succeed, however long memory is exhausted.
  while (
      !post_or_retry(state_->io.get_executor(), [state = state_.get()] { state->begin_drain(); })) {
  }
}

void Server::change(Access access) {
  asio::post(state_->io, [state = state_.get(), access = std::move(access)]() mutable {
    state->change(std::move(access));
  });
}

}  // namespace windsplat::transport
