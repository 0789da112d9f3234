#include "server/session/pacing/still_queue.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "protocol/limits.hpp"

namespace windsplat::session {
namespace {

namespace limits = protocol::limits;

Result<void> size_still(const protocol::StillMessage& message, protocol::View& view) {
  const auto scaled = [&](int edge) {
    return static_cast<std::int64_t>(std::ceil(edge * message.scale));
  };
  const std::int64_t width = scaled(message.width.value_or(view.image.width));
  const std::int64_t height = scaled(message.height.value_or(view.image.height));
  const std::string size = std::to_string(width) + " x " + std::to_string(height) + " pixels";
  if (std::max(width, height) > limits::image_edge_max) {
    return make_error_at(ErrorKind::too_large, "/scale",
                         "makes the picture " + size + "; no edge may be longer than " +
                             std::to_string(limits::image_edge_max));
  }
  if (width * height > limits::image_pixels_max) {
    return make_error_at(
        ErrorKind::too_large, "/scale",
        "makes the picture " + size + "; the limit is " + std::to_string(limits::image_pixels_max));
  }
  view.image.width = static_cast<int>(width);
  view.image.height = static_cast<int>(height);
  return {};
}

}  // namespace

Result<void> StillQueue::add(Still still) {
  if (waiting_.size() >= waiting_max) {
    return make_error(ErrorKind::busy, "earlier stills are pending; wait for one to finish");
  }
  if (auto fits = size_still(still.message, still.view); !fits) return fits;
  if (waiting_.empty()) turn_ = false;
  waiting_.push_back(std::move(still));
  return {};
}

Still StillQueue::take() {
  Still still = std::move(waiting_.front());
  waiting_.pop_front();
  turn_ = false;
  return still;
}

void StillQueue::moving_frame_sent() {
  if (!waiting_.empty()) turn_ = true;
}

}  // namespace windsplat::session
