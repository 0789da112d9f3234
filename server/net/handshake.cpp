// A TLS handshake in two halves. `Handshake` is used by the io thread alone: it holds the
// connection's place and deadline. `TlsTask` is used by the handshake thread alone until that posts
// it back; it holds the socket, and the other half ends it by shutdown(2), which any thread may
// call.
#include "server/net/handshake.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "server/base/log.hpp"
#include "server/net/address.hpp"
#include "server/net/guarded.hpp"
#include "server/net/http_session.hpp"
#include "server/net/post.hpp"
#include "server/net/tls_context.hpp"
#include "server/net/wire.hpp"

namespace windsplat::net {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds tls_timeout{5};
constexpr std::chrono::seconds tls_reserve_timeout{2};  // of a connection of the reserve
// At a time; the longest ends for one more.
constexpr std::size_t tls_handshakes_max = 256;
constexpr std::size_t handshakes_per_address_max = 64;
// After which no more is read. A ClientHello has some 500 bytes, 2 KB with a post-quantum key
// share; OpenSSL would take 131 kB.
constexpr std::size_t handshake_bytes_max = std::size_t{16} * 1024;
// One read of Asio's: the client's last message may come with the data that follow it.
constexpr std::size_t last_read_bytes = std::size_t{17} * 1024;

class TlsTask final : public HandshakeTask {
 public:
  TlsTask(asio::ip::tcp::socket socket, std::shared_ptr<TlsContext> tls, HandshakeThread& thread,
          Admission& admission, const std::string& peer)
      : HandshakeTask(thread, counted_address(peer)),
        handle_(socket.native_handle()),
        wire_(std::move(socket), std::move(tls)),
        io_(wire_.get_executor()),
        admission_(admission),
        peer_(peer) {}

  // On the io thread. `done` is called there, with the fault, unless this is abandoned.
  template <class Done>
  void start(Done done) {
    failed_ = done;
    submit([this, done = std::move(done)]() mutable {
      const HandshakeExecutor executor(*this, asio::query(io_, asio::execution::context));
      wire_.handshake(executor, IoHandler([task = shared_from_this(), io = io_,
                                           done = std::move(done)](ErrorCode fault, std::size_t) {
                        post_surely(io, [task, done, fault] { done(fault); });
                      }));
    });
  }

  // Any thread. The handshake fails; a step that waits for its turn is not begun.
  void abandon() {
    abandoned_ = true;
    ::shutdown(handle_, SHUT_RDWR);
  }

  [[nodiscard]] bool is_abandoned() const { return abandoned_; }

  // When it is done.
  Wire take_wire() { return std::move(wire_); }

 private:
  bool may_go_on() override {
    if (abandoned_) return false;
    const std::size_t bytes = wire_.next_layer().rate_policy().bytes_read();
    if (bytes <= handshake_bytes_max + last_read_bytes) return true;
    // Nothing more is read: a shutdown alone would leave what has arrived to be read.
    abandoned_ = true;
    post_surely(io_, [task = shared_from_this(), failed = failed_] {
      failed(make_error_code(boost::system::errc::message_size));
    });
    return false;
  }
  void step_took(std::int64_t cpu_us) override { admission_.handshake_took(peer_, cpu_us); }

  const int handle_;  // open as long as this lives, or wire_ after it was taken
  Wire wire_;
  const asio::any_io_executor io_;
  Admission& admission_;
  const std::string peer_;
  std::function<void(ErrorCode)> failed_;  // as for start(); called on the io thread
  std::atomic<bool> abandoned_{false};
};

class Handshake : public Connection, public std::enable_shared_from_this<Handshake> {
 public:
  Handshake(asio::ip::tcp::socket socket, Services& services, Connections& connections,
            HandshakeThread& thread, Visitor visitor)
      : services_(services),
        connections_(connections),
        id_(connections.next_id()),
        visitor_(std::move(visitor)),
        address_(counted_address(visitor_.peer)),
        deadline_(socket.get_executor()),
        task_(std::make_shared<TlsTask>(std::move(socket), services.options.tls, thread,
                                        services.admission, visitor_.peer)) {}
  ~Handshake() override { connections_.remove(id_); }
  Handshake(const Handshake&) = delete;
  Handshake& operator=(const Handshake&) = delete;

  void start() {
    late_ = services_.draining;
    connections_.add(id_, weak_from_this(), false, late_);
    deadline_.expires_after(visitor_.reserve ? tls_reserve_timeout : tls_timeout);
    deadline_.async_wait(guarded(shared_from_this(), [this](ErrorCode fault) {
      if (!fault) abort();
    }));
    if (!visitor_.trusted) {
      (void)connections_.end_longest(
          [this](const Connection& other) {
            return other.is_of(address_) ? other.handshaking_since() : std::nullopt;
          },
          handshakes_per_address_max);
    }
    (void)connections_.end_longest(&Connection::handshaking_since, tls_handshakes_max);
    task_->start([weak = weak_from_this()](ErrorCode fault) {
      const auto self = weak.lock();
      if (self) guarded(self, [&] { self->on_done(fault); })();
    });
  }

  void drain() override {}  // it is waited for
  void abort() override {
    if (task_) task_->abandon();
    end();
  }

  [[nodiscard]] Since unasked_since() const override {
    return visitor_.reserve ? handshaking_since() : std::nullopt;
  }
  [[nodiscard]] Since handshaking_since() const override {
    return task_ ? Since(came_) : std::nullopt;
  }
  [[nodiscard]] bool is_of(const std::string& address) const override {
    return address == address_;
  }
  [[nodiscard]] std::string request_id() const { return {}; }

 private:
  void on_done(ErrorCode fault) {
    if (!task_) return;
    if (task_->is_abandoned()) return abort();  // a step that was dropped may still hold its wire
    // From here on its descriptor is the wire's, which may close it.
    Wire wire = std::exchange(task_, nullptr)->take_wire();
    if (!fault) {
      start_http_session(std::move(wire), services_, connections_, std::move(visitor_), late_);
    } else if (is_plain_http(fault)) {
      wire.forgo_tls();
      refuse_plain_http(std::move(wire), services_, connections_, std::move(visitor_), late_);
    } else {
      log::debug("a TLS handshake failed", {{"fault", fault.message()}});
    }
    end();
  }

  void end() {
    task_.reset();
    deadline_.cancel();      // whose handler holds the last reference
    visitor_.place.reset();  // now, and not when that has gone
  }

  Services& services_;
  Connections& connections_;
  const std::uint64_t id_;
  Visitor visitor_;
  const std::string address_;
  const Clock::time_point came_ = Clock::now();
  asio::steady_timer deadline_;
  std::shared_ptr<TlsTask> task_;  // null: it is done
  bool late_ = false;              // it came while a drain waits for the others
};

}  // namespace

void start_connection(asio::ip::tcp::socket socket, Services& services, Connections& connections,
                      HandshakeThread* handshakes, Visitor visitor) {
  if (handshakes == nullptr) {
    start_http_session(Wire(std::move(socket), nullptr), services, connections, std::move(visitor),
                       services.draining);
    return;
  }
  std::make_shared<Handshake>(std::move(socket), services, connections, *handshakes,
                              std::move(visitor))
      ->start();
}

}  // namespace windsplat::net
