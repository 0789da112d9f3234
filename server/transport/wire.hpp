// The byte stream of one connection, over TCP or TLS. A single type, so that Beast's HTTP and
// WebSocket templates are compiled once. Include in session sources only.
#pragma once

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <type_traits>
#include <utility>

#include "server/transport/handshake_thread.hpp"
#include "server/transport/stream.hpp"
#include "server/transport/tls.hpp"

namespace windsplat::transport {

// A type-erased completion handler, so that the TLS layer is compiled once. Called once.
class IoHandler {
 public:
  template <class Handler, class = std::enable_if_t<!std::is_same_v<Handler, IoHandler>>>
  explicit IoHandler(Handler handler)
      : held_(std::make_unique<Held<Handler>>(std::move(handler))) {}

  void operator()(ErrorCode fault, std::size_t bytes) {
    Anything& held = *held_;
    held.call(std::move(held_), fault, bytes);
  }
  void operator()(ErrorCode fault) { (*this)(fault, 0); }

 private:
  struct Anything {
    virtual ~Anything() = default;
    virtual void call(std::unique_ptr<Anything> self, ErrorCode fault, std::size_t bytes) = 0;
  };
  template <class Handler>
  struct Held final : Anything {
    explicit Held(Handler given) : handler(std::move(given)) {}
    void call(std::unique_ptr<Anything> self, ErrorCode fault, std::size_t bytes) override {
      Handler own(std::move(handler));
      self.reset();  // release memory before the call, as Asio does
      own(fault, bytes);
    }
    Handler handler;
  };

  std::unique_ptr<Anything> held_;
};

// An AsyncReadStream and AsyncWriteStream of Asio, for completion handlers only. One read and one
// write may be pending at a time; they survive a move.
class Wire {
 public:
  using executor_type = TcpStream::executor_type;
  using next_layer_type = TcpStream;

  // `tls` null: plain TCP. Otherwise call handshake() first.
  Wire(StreamSocket socket, std::shared_ptr<TlsContext> tls);
  ~Wire();
  Wire(Wire&&) noexcept;
  Wire& operator=(Wire&&) = delete;

  executor_type get_executor() { return tcp().get_executor(); }
  next_layer_type& next_layer() { return tcp(); }
  [[nodiscard]] const next_layer_type& next_layer() const { return *tcp_; }
  [[nodiscard]] bool secure() const { return tls_ != nullptr; }

  // The handshake runs on `executor`; until `done` is called, use this object on that executor
  // only. Another thread can abort it by shutdown() of the descriptor.
  void handshake(const HandshakeExecutor& executor, IoHandler done);
  // Falls back to plain TCP after a failed handshake.
  void forgo_tls();
  // Sends close_notify. Completes when it is written, without waiting for the peer's; write nothing
  // afterwards.
  void say_goodbye(IoHandler done);
  void close();  // pending operations end with an error

  // HTTP or WebSocket bytes received since the last forget(), without TLS overhead.
  [[nodiscard]] std::size_t bytes_read() const;
  void forget();

  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    if (!secure()) {
      tcp().async_read_some(buffers, std::forward<Handler>(handler));
    } else {
      read_tls(first_of(buffers), IoHandler(std::forward<Handler>(handler)));
    }
  }
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    if (!secure()) {
      tcp().async_write_some(buffers, std::forward<Handler>(handler));
    } else {
      write_tls(gathered(buffers), IoHandler(std::forward<Handler>(handler)));
    }
  }

 private:
  struct Tls;

  TcpStream& tcp() { return *tcp_; }
  using Record = std::array<std::uint8_t, 16384>;  // capacity for one TLS record
  Record& record();                                // allocated on first use
  void read_tls(asio::mutable_buffer into, IoHandler done);
  void write_tls(asio::const_buffer from, IoHandler done);

  template <class Buffers>
  static asio::mutable_buffer first_of(const Buffers& buffers) {
    for (auto at = asio::buffer_sequence_begin(buffers); at != asio::buffer_sequence_end(buffers);
         ++at) {
      if (const asio::mutable_buffer buffer(*at); buffer.size() > 0) return buffer;
    }
    return {};
  }
  // Combines small buffers into one record, and so one packet: the header of a frame with its
  // picture.
  template <class Buffers>
  asio::const_buffer gathered(const Buffers& buffers) {
    const auto begin = asio::buffer_sequence_begin(buffers);
    if (begin == asio::buffer_sequence_end(buffers)) return {};
    const asio::const_buffer first(*begin);
    if (first.size() >= std::tuple_size_v<Record> || first.size() == asio::buffer_size(buffers))
      return first;
    return asio::buffer(record().data(), asio::buffer_copy(asio::buffer(record()), buffers));
  }

  std::unique_ptr<TcpStream> tcp_;  // stable address: pending operations refer to it
  std::unique_ptr<Tls> tls_;
};

// Teardown of a WebSocket connection, called by Beast.
template <class Handler>
void async_teardown(beast::role_type role, Wire& wire, Handler&& handler) {
  using beast::websocket::async_teardown;
  if (!wire.secure()) {
    async_teardown(role, wire.next_layer().socket(), std::forward<Handler>(handler));
    return;
  }
  wire.say_goodbye(IoHandler(
      [role, &wire, handler = std::forward<Handler>(handler)](ErrorCode, std::size_t) mutable {
        using beast::websocket::async_teardown;
        async_teardown(role, wire.next_layer().socket(), std::move(handler));
      }));
}

}  // namespace windsplat::transport
