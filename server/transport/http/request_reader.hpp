// The receiving side of an HTTP session: first byte, header and body of a request, each with a
// deadline.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/transport/http/current_request.hpp"
#include "server/transport/http/http_owner.hpp"
#include "server/transport/http/http_wire.hpp"
#include "server/transport/http/request_parser.hpp"

namespace windsplat::transport {

class RequestReader {
 public:
  using Since = std::optional<std::chrono::steady_clock::time_point>;

  // Requests are read into `current`.
  RequestReader(HttpOwner& owner, HttpWire& wire, CurrentRequest& current);

  // Reads the next request up to its header. `draining`: waits a short time for it.
  void next(bool draining);
  // Into the request, or into its sink. Refused if it is too large for the request.
  void read_body();
  [[nodiscard]] std::uint64_t body_bytes() const;  // of the request whose header has been read
  // While a request is answered, detects a peer that disconnects. The read continues after the
  // response, since a TLS record must not be abandoned; the data belong to the next request.
  // Skipped if the next request is already buffered.
  void watch();
  void stop();  // ignores what still arrives

  [[nodiscard]] RequestParser& input() { return input_; }
  [[nodiscard]] Since idle_since() const { return idle_since_; }        // awaits a first byte
  [[nodiscard]] Since unasked_since() const { return unasked_since_; }  // no complete request yet
  [[nodiscard]] bool has_ended() const { return ended_; }               // see HttpOwner::on_end()

 private:
  void begin_header();
  void read_some();
  void find_header_end();
  void read_rest();
  void stream_some();
  void hand_over(std::vector<std::byte> bytes);
  void complete();

  HttpOwner& owner_;
  HttpWire& wire_;
  CurrentRequest& current_;
  RequestParser input_;
  Since idle_since_;
  Since unasked_since_ = std::chrono::steady_clock::now();
  std::uint64_t unread_bytes_ = 0;  // of a body that a sink takes
  bool in_header_ = false;          // reading a header
  bool ended_ = false;
};

}  // namespace windsplat::transport
