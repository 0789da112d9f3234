// The interface of a WebSocket session to its parts, which do not outlive it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "server/transport/guarded.hpp"

namespace windsplat::transport {

// Close codes (RFC 6455, section 7.4.1, and its IANA registry).
inline constexpr int close_policy = 1008;
inline constexpr int close_too_big = 1009;
inline constexpr int close_fault = 1011;
inline constexpr int close_full = 1013;

class StreamOwner : public std::enable_shared_from_this<StreamOwner> {
 public:
  StreamOwner(std::uint64_t id, std::string request_id)
      : id_(id), request_id_(std::move(request_id)) {}
  virtual ~StreamOwner() = default;
  StreamOwner(const StreamOwner&) = delete;
  StreamOwner& operator=(const StreamOwner&) = delete;

  [[nodiscard]] std::uint64_t id() const { return id_; }
  [[nodiscard]] const std::string& request_id() const { return request_id_; }
  [[nodiscard]] bool is_open() const { return open_; }
  [[nodiscard]] bool has_ended() const { return ended_; }

  // Closes within a time limit; queued text messages are dropped.
  virtual void close(int code, const std::string& reason) = 0;
  virtual void abort() = 0;  // end immediately
  virtual void on_disconnected() = 0;
  virtual void on_text_written() = 0;

  // A completion handler that keeps the session alive.
  template <class Body>
  auto handler(Body body) {
    return guarded(shared_from_this(), std::move(body));
  }

 protected:
  const std::uint64_t id_;
  const std::string request_id_;
  bool open_ = false;   // accepted, and not closing
  bool ended_ = false;  // disconnected
};

}  // namespace windsplat::transport
