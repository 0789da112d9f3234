// TLS handshakes in two halves. `Handshake` belongs to the io thread and holds the connection's
// slot and deadline. `TlsTask` holds the socket and belongs to the handshake thread until it is
// posted back. `Handshake` ends it by shutdown(2), which is safe from any thread, and removes its
// waiting step: the descriptor then stays open only until the running step ends.
#include "server/transport/handshake.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/access/address.hpp"
#include "server/base/log.hpp"
#include "server/transport/guarded.hpp"
#include "server/transport/post_or_retry.hpp"
#include "server/transport/tls_context.hpp"
#include "server/transport/wire.hpp"

namespace windsplat::transport {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds tls_timeout{5};
constexpr std::chrono::seconds tls_reserve_timeout{2};  // for connections of the reserve
// Limit on concurrent handshakes; above it, an existing one is ended.
constexpr std::size_t tls_handshakes_max = 256;
constexpr std::size_t handshakes_per_address_max = 64;
// Limit on bytes read. A ClientHello has about 500 bytes, 2 KB with a post-quantum key share;
// OpenSSL would accept 131 kB.
constexpr std::size_t handshake_bytes_max = std::size_t{16} * 1024;
// Size of one read of Asio: the client's last message may arrive with following data.
constexpr std::size_t last_read_bytes = std::size_t{17} * 1024;

class TlsTask final : public HandshakeTask {
 public:
  TlsTask(StreamSocket socket, std::shared_ptr<TlsContext> tls, HandshakeThread& thread,
          access::Admission& admission, const access::Visitor& visitor)
      : HandshakeTask(thread, access::counted_address(visitor.peer)),
        handle_(socket.native_handle()),
        wire_(std::move(socket), std::move(tls)),
        io_(wire_.get_executor()),
        admission_(admission),
        trusted_(visitor.trusted) {}
  // Processor time that is not yet charged if an allocation failed on completion.
  ~TlsTask() override { charge(); }
  TlsTask(const TlsTask&) = delete;
  TlsTask& operator=(const TlsTask&) = delete;

  // Call on the io thread. `done` is called there with the error; after abandon() it may be called
  // any number of times.
  void start(std::function<void(ErrorCode)> done) {
    done_ = std::move(done);
    submit([this] {
      const HandshakeExecutor executor(*this, asio::query(io_, asio::execution::context));
      wire_.handshake(executor, IoHandler([this, task = shared_from_this()](
                                              ErrorCode fault, std::size_t) { outcome_ = fault; }));
    });
  }

  // Call on the io thread. Fails the handshake.
  void abandon() {
    drop();
    ::shutdown(handle_, SHUT_RDWR);
    charge();
  }

  [[nodiscard]] bool is_abandoned() const { return is_dropped(); }

  // Call on the io thread, after completion.
  Wire take_wire() { return std::move(wire_); }

 private:
  bool may_go_on() override {
    if (is_abandoned()) return false;
    const std::size_t bytes = wire_.next_layer().rate_policy().bytes_read();
    if (bytes <= handshake_bytes_max + last_read_bytes) return true;
    // Stops reading: shutdown alone would leave received data readable.
    begin_no_more();
    go_back();
    return false;
  }
  // Charged by the io thread, which must not wait for a lock that this thread holds: before the
  // next step, on completion or abandonment, and in go_back() for a step that ran meanwhile.
  void step_took(std::int64_t cpu_us) override {
    unpaid_us_ += cpu_us;
    if (outcome_ || is_abandoned()) go_back();
  }
  void go_back() {
    post_or_retry(io_, [this, task = shared_from_this()] {
      charge();
      done_(outcome_.value_or(asio::error::operation_aborted));
    });
  }
  void pay() override { charge(); }
  void charge() {
    const std::int64_t us = unpaid_us_.exchange(0);
    if (us > 0) admission_.handshake_took(address(), trusted_, us);
  }

  const int handle_;  // the descriptor is open while this object, or wire_ after the move, exists
  Wire wire_;
  const asio::any_io_executor io_;
  access::Admission& admission_;
  const bool trusted_;
  std::function<void(ErrorCode)> done_;
  std::optional<ErrorCode> outcome_;
  std::atomic<std::int64_t> unpaid_us_{0};
};

class Handshake : public Connection, public std::enable_shared_from_this<Handshake> {
 public:
  Handshake(const HttpContext& context, StreamSocket socket, HandshakeThread& thread,
            access::Visitor visitor)
      : context_(context),
        id_(context.connections.next_id()),
        visitor_(std::move(visitor)),
        address_(access::counted_address(visitor_.peer)),
        deadline_(socket.get_executor()),
        task_(std::make_shared<TlsTask>(std::move(socket), context.options.tls, thread,
                                        context.admission, visitor_)) {}
  ~Handshake() override { context_.connections.remove(id_); }
  Handshake(const Handshake&) = delete;
  Handshake& operator=(const Handshake&) = delete;

  void start() {
    late_ = context_.draining;
    context_.connections.add(id_, weak_from_this(), false, late_);
    deadline_.expires_after(visitor_.reserve ? tls_reserve_timeout : tls_timeout);
    deadline_.async_wait(guarded(shared_from_this(), [this](ErrorCode fault) {
      if (!fault) abort();
    }));
    if (!visitor_.trusted) {
      (void)context_.connections.end_longest(
          [this](const Connection& other) {
            return other.address() == address_ ? other.handshaking_since() : std::nullopt;
          },
          handshakes_per_address_max);
    }
    (void)context_.connections.end_handshake(tls_handshakes_max);
    if (!task_) return;  // already completed
    task_->start([weak = weak_from_this()](ErrorCode fault) {
      const auto self = weak.lock();
      if (self) guarded(self, [&] { self->on_done(fault); })();
    });
  }

  void drain() override {}  // drains wait for the handshake
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
  [[nodiscard]] std::string_view address() const override { return address_; }
  [[nodiscard]] bool is_known() const override { return visitor_.known; }
  [[nodiscard]] std::string request_id() const { return {}; }

 private:
  void on_done(ErrorCode fault) {
    if (!task_) return;
    if (task_->is_abandoned()) return abort();  // its step may still use the connection
    // From here on the wire owns the descriptor and may close it.
    Wire wire = std::exchange(task_, nullptr)->take_wire();
    if (!fault) {
      start_http_session(context_, std::move(wire), std::move(visitor_), late_);
    } else if (is_plain_http(fault)) {
      wire.forgo_tls();
      refuse_plain_http(context_, std::move(wire), std::move(visitor_), late_);
    } else {
      log::debug("TLS handshake failed", {{"fault", fault.message()}});
    }
    end();
  }

  void end() {
    task_.reset();
    deadline_.cancel();      // the handler of the timer holds the last reference
    visitor_.place.reset();  // free the slot at once
  }

  const HttpContext& context_;
  const std::uint64_t id_;
  access::Visitor visitor_;
  const std::string address_;
  const Clock::time_point came_ = Clock::now();
  asio::steady_timer deadline_;
  std::shared_ptr<TlsTask> task_;  // null: the handshake has ended
  bool late_ = false;              // accepted during a drain
};

}  // namespace

void start_connection(const HttpContext& context, StreamSocket socket, HandshakeThread* handshakes,
                      access::Visitor visitor) {
  if (handshakes == nullptr) {
    start_http_session(context, Wire(std::move(socket), nullptr), std::move(visitor),
                       context.draining);
    return;
  }
  std::make_shared<Handshake>(context, std::move(socket), *handshakes, std::move(visitor))->start();
}

}  // namespace windsplat::transport
