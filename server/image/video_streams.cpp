#include "server/image/video_streams.hpp"

namespace windsplat::image {

std::shared_ptr<VideoEncoder> VideoStreams::open() {
  if (++open_ > streams_max) {
    --open_;
    return nullptr;
  }
  counted_(1);
  auto encoder = std::make_unique<VideoEncoder>();
  return {encoder.release(), [this](VideoEncoder* freed) {
            const std::unique_ptr<VideoEncoder> owned(freed);
            counted_(-1);
            --open_;
          }};
}

}  // namespace windsplat::image
