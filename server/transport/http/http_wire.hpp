// The socket of an HTTP session: its deadline, the end of its peer, and a close that loses no
// response.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>

#include "server/transport/http/http_owner.hpp"
#include "server/transport/http/request_parser.hpp"
#include "server/transport/wire.hpp"

namespace windsplat::transport {

class HttpWire {
 public:
  // `reserve`: the connection is one of the reserve, whose deadlines are short.
  HttpWire(HttpOwner& owner, Wire wire, bool reserve);

  [[nodiscard]] Wire& wire() { return wire_; }
  [[nodiscard]] bool secure() const { return wire_.secure(); }
  [[nodiscard]] bool is_of_reserve() const { return reserve_; }
  // Whether the peer has closed its side, even behind unread data.
  [[nodiscard]] bool peer_has_left();

  // Sets the deadline of the current operation, after which the connection is closed, until the
  // next call or the one below.
  void within(std::chrono::milliseconds time);
  void with_no_deadline();

  // Calls `done(ErrorCode)` when bytes were added to the parser's buffer. One read at a time:
  // ignored while one is pending.
  template <class Done>
  void read_some(RequestParser& into, Done done) {
    if (reading_) return;
    reading_ = true;
    wire_.async_read_some(into.prepare(), owner_.handler([this, &into, done = std::move(done)](
                                                             ErrorCode fault, std::size_t bytes) {
      reading_ = false;
      if (lingering_) return fault ? owner_.close() : discard_input(into);
      if (!fault) into.buffer().commit(bytes);
      done(fault);
    }));
  }
  // Ends sending and discards input until the peer closes: closing with unread bytes resets the
  // connection, and the peer might lose the response.
  void linger(RequestParser& into);
  void close();

 private:
  void end_sending(RequestParser& into);
  void discard_input(RequestParser& into);

  HttpOwner& owner_;
  Wire wire_;
  asio::steady_timer deadline_;
  const bool reserve_;
  bool reading_ = false;    // a read is under way
  bool lingering_ = false;  // discarding input before closing
};

}  // namespace windsplat::transport
