// VideoEncoder of a build without OpenH264.
#include "server/image/video_encoder.hpp"

namespace windsplat::image {

struct VideoEncoder::State {};

bool VideoEncoder::available() { return false; }

VideoEncoder::VideoEncoder() = default;
VideoEncoder::~VideoEncoder() = default;

Result<VideoUnit> VideoEncoder::encode(const YccPicture& /*picture*/, int /*quality*/,
                                       bool /*key*/) {
  return make_error(ErrorKind::internal, "windsplat was built without OpenH264");
}

}  // namespace windsplat::image
