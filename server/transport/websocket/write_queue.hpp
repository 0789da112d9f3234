// What a session has to send: text messages in order, which precede frames, and at most one frame.
// The metrics count its bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "protocol/frame_header.hpp"
#include "server/metrics/metrics.hpp"
#include "server/session/effects.hpp"

namespace windsplat::transport {

struct QueuedFrame {
  std::array<std::uint8_t, protocol::frame_header_bytes> header;
  session::Payload payload;
  session::Tier tier;
  protocol::FrameHeader facts;
  bool stands_in;

  [[nodiscard]] std::size_t bytes() const { return header.size() + payload->size(); }
};

class WriteQueue {
 public:
  explicit WriteQueue(metrics::Metrics& metrics) : metrics_(metrics) {}
  ~WriteQueue() { hold(-held_bytes_); }
  WriteQueue(const WriteQueue&) = delete;
  WriteQueue& operator=(const WriteQueue&) = delete;

  void add(std::string text);
  void set(QueuedFrame frame);  // the session provides the next frame after the write
  void pop_text();
  void pop_frame();

  [[nodiscard]] const std::deque<std::string>& texts() const { return texts_; }
  [[nodiscard]] const std::optional<QueuedFrame>& frame() const { return frame_; }
  // More text is queued for a slow peer than allowed: stop reading from it.
  [[nodiscard]] bool is_backlogged() const;

 private:
  void hold(std::int64_t more_bytes);

  metrics::Metrics& metrics_;
  std::deque<std::string> texts_;
  std::size_t text_bytes_ = 0;
  std::optional<QueuedFrame> frame_;
  std::int64_t held_bytes_ = 0;  // size of texts_ and frame_
};

}  // namespace windsplat::transport
