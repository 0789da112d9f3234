#include "server/transport/websocket/write_queue.hpp"

#include <utility>

namespace windsplat::transport {
namespace {

constexpr std::size_t waiting_text_bytes_max = std::size_t{256} * 1024;

}  // namespace

void WriteQueue::add(std::string text) {
  texts_.push_back(std::move(text));
  text_bytes_ += texts_.back().size();
  hold(static_cast<std::int64_t>(texts_.back().size()));
}

void WriteQueue::set(QueuedFrame frame) {
  frame_ = std::move(frame);
  hold(static_cast<std::int64_t>(frame_->bytes()));
}

void WriteQueue::pop_text() {
  text_bytes_ -= texts_.front().size();
  hold(-static_cast<std::int64_t>(texts_.front().size()));
  texts_.pop_front();
}

void WriteQueue::pop_frame() {
  hold(-static_cast<std::int64_t>(frame_->bytes()));
  frame_.reset();
}

bool WriteQueue::is_backlogged() const { return text_bytes_ > waiting_text_bytes_max; }

void WriteQueue::hold(std::int64_t more_bytes) {
  held_bytes_ += more_bytes;
  metrics_.unsent(more_bytes);
}

}  // namespace windsplat::transport
