// Limits the video encoders of all sessions.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <utility>

#include "server/image/video_encoder.hpp"

namespace windsplat::image {

// Thread-safe. Outlives its encoders.
class VideoStreams {
 public:
  // 9 MB each at 1280 x 720, 20 MB at 1920 x 1088.
  static constexpr int streams_max = 16;

  // `counted` is called on any thread with 1 for each encoder opened, and with -1 when it is freed.
  explicit VideoStreams(std::function<void(int more)> counted) : counted_(std::move(counted)) {}

  // Whether this build can encode.
  [[nodiscard]] static bool available() { return VideoEncoder::available(); }

  // Null: all are in use.
  std::shared_ptr<VideoEncoder> open();

 private:
  std::function<void(int more)> counted_;
  std::atomic<int> open_ = 0;
};

}  // namespace windsplat::image
