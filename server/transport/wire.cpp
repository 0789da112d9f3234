// Connection over TCP or TLS: Asio's TLS stream on top of the TCP stream.
#include "server/transport/wire.hpp"

#include <openssl/ssl.h>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/ssl/stream.hpp>

#include "server/transport/tls_context.hpp"

namespace windsplat::transport {

struct Wire::Tls {
  Tls(TcpStream& tcp, std::shared_ptr<TlsContext> with)
      : context(std::move(with)), stream(tcp, context->context) {}

  std::shared_ptr<TlsContext> context;  // must outlive all its connections
  asio::ssl::stream<TcpStream&> stream;
  std::unique_ptr<Record> record;
  std::size_t bytes_read = 0;
  // A second TLS operation waits for the first on a timer that closing the socket does not cancel:
  // if an allocation failure loses the first, the second would keep its session alive.
  asio::cancellation_signal stop_reading;
  asio::cancellation_signal stop_writing;
};

Wire::Wire(StreamSocket socket, std::shared_ptr<TlsContext> tls)
    : tcp_(std::make_unique<TcpStream>(std::move(socket))),
      tls_(tls ? std::make_unique<Tls>(*tcp_, std::move(tls)) : nullptr) {}

Wire::~Wire() = default;
Wire::Wire(Wire&&) noexcept = default;

void Wire::handshake(const HandshakeExecutor& executor, IoHandler done) {
  tls_->stream.async_handshake(asio::ssl::stream_base::server,
                               asio::bind_executor(executor, std::move(done)));
}

void Wire::forgo_tls() { tls_.reset(); }

void Wire::say_goodbye(IoHandler done) {
  // Act as if the peer had sent close_notify: otherwise Asio waits for it.
  SSL_set_shutdown(tls_->stream.native_handle(), SSL_RECEIVED_SHUTDOWN);
  tls_->stream.async_shutdown(
      asio::bind_cancellation_slot(tls_->stop_writing.slot(), std::move(done)));
}

void Wire::close() {
  if (tcp_) tcp_->close();
  if (!tls_) return;
  tls_->stop_reading.emit(asio::cancellation_type::terminal);
  tls_->stop_writing.emit(asio::cancellation_type::terminal);
}

std::size_t Wire::bytes_read() const {
  return tls_ ? tls_->bytes_read : tcp_->rate_policy().bytes_read();
}

void Wire::forget() {
  tcp().rate_policy().forget();
  if (tls_) tls_->bytes_read = 0;
}

Wire::Record& Wire::record() {
  if (!tls_->record) tls_->record = std::make_unique<Record>();
  return *tls_->record;
}

void Wire::read_tls(asio::mutable_buffer into, IoHandler done) {
  auto counted = [tls = tls_.get(), done = std::move(done)](ErrorCode fault,
                                                            std::size_t bytes) mutable {
    tls->bytes_read += bytes;
    done(fault, bytes);
  };
  tls_->stream.async_read_some(
      into, asio::bind_cancellation_slot(tls_->stop_reading.slot(), std::move(counted)));
}

void Wire::write_tls(asio::const_buffer from, IoHandler done) {
  tls_->stream.async_write_some(
      from, asio::bind_cancellation_slot(tls_->stop_writing.slot(), std::move(done)));
}

}  // namespace windsplat::transport
