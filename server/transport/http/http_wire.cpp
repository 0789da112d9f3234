#include "server/transport/http/http_wire.hpp"

#include <algorithm>
#include <utility>

#include "server/transport/peer.hpp"

namespace windsplat::transport {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds reserve_timeout{2};  // deadline of each phase of a connection of the
                                                    // reserve
constexpr std::chrono::seconds linger_timeout{2};   // deadline for discarding a refused body

}  // namespace

HttpWire::HttpWire(HttpOwner& owner, Wire wire, bool reserve)
    : owner_(owner), wire_(std::move(wire)), deadline_(wire_.get_executor()), reserve_(reserve) {}

bool HttpWire::peer_has_left() {
  return transport::peer_has_left(wire_.next_layer().socket().native_handle());
}

void HttpWire::within(std::chrono::milliseconds time) {
  if (reserve_) time = std::min<std::chrono::milliseconds>(time, reserve_timeout);
  deadline_.expires_after(time);
  deadline_.async_wait(owner_.handler([this](ErrorCode fault) {
    if (!fault && deadline_.expiry() <= Clock::now()) owner_.close();
  }));
}

void HttpWire::with_no_deadline() { deadline_.expires_at(Clock::time_point::max()); }

void HttpWire::linger(RequestParser& into) {
  lingering_ = true;
  within(linger_timeout);
  if (!wire_.secure()) return end_sending(into);
  wire_.say_goodbye(
      IoHandler(owner_.handler([this, &into](ErrorCode, std::size_t) { end_sending(into); })));
}

void HttpWire::end_sending(RequestParser& into) {
  ErrorCode ignored;
  wire_.next_layer().socket().shutdown(asio::socket_base::shutdown_send, ignored);
  discard_input(into);
}

// Reads from TCP directly: TLS errors no longer matter.
void HttpWire::discard_input(RequestParser& into) {
  if (reading_) return;
  reading_ = true;
  wire_.next_layer().async_read_some(into.prepare_discarded(),
                                     owner_.handler([this, &into](ErrorCode fault, std::size_t) {
                                       reading_ = false;
                                       if (fault) return owner_.close();
                                       discard_input(into);
                                     }));
}

void HttpWire::close() {
  deadline_.cancel();
  wire_.close();
}

}  // namespace windsplat::transport
