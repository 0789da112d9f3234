#include "server/session/pacing/moving_encoding.hpp"

#include <algorithm>

#include "server/quality/pick.hpp"
#include "server/quality/sizes.hpp"

namespace windsplat::session {
namespace {

constexpr int key_quality_least = 15;
constexpr int key_quality_step = 5;

quality::Setting at_level(int level) {
  quality::Setting setting;
  setting.half_level = 2 * level;
  return setting;
}

}  // namespace

int MovingEncoding::least_level(const protocol::View& view, const Link& link, VideoChoice& video,
                                Micros budget, Micros now) {
  const int width = view.image.width;
  const int height = view.image.height;
  const double pixels = static_cast<double>(width) * height;
  video.choose(jpeg_.time_on(link, pixels, VideoChoice::quality_low),
               jpeg_.time_on(link, pixels, VideoChoice::quality_good), budget, now);
  const int of_jpeg = jpeg_.least_level(width, height, link, budget);
  if (!video.on()) return of_jpeg;
  int level = video_.least_level(width, height, link, budget);
  const auto fits = [&] {
    const auto size = quality::size_at(quality::PictureSize{width, height}, at_level(level));
    return video.fits(size.width, size.height);
  };
  while (level < of_jpeg && !fits()) ++level;
  return level;
}

// The client waits for a key frame as for a JPEG, so its quality is that of a JPEG which takes no
// longer than a moving frame may; the frames after it improve the picture.
Encoding MovingEncoding::choose(const protocol::View& view, const quality::Setting& setting,
                                const Link& link, const VideoChoice& video, Micros budget) {
  Encoding encoding;
  const double pixels = quality::pixels_at(view, setting);
  const quality::PictureSize size = quality::size_at(view, setting);
  if (!video.on() || !video.fits(size.width, size.height)) {
    encoding.quality = jpeg_.choose(pixels, link, budget);
    return encoding;
  }
  encoding.codec = protocol::Codec::h264;
  encoding.quality = video_.choose(pixels, link, budget);
  encoding.key = video.needs_key() || size != video_size_;
  video_size_ = size;
  if (!encoding.key) return encoding;
  const Micros most = std::max(budget, JpegRate::moving_most_us);
  while (encoding.quality > key_quality_least &&
         jpeg_.time_on(link, pixels, encoding.quality) > most) {
    encoding.quality -= key_quality_step;
  }
  return encoding;
}

void MovingEncoding::learn(const Drawn& drawn, int quality, std::size_t frame_bytes,
                           std::size_t text_bytes) {
  was_video_ = drawn.video;
  if (drawn.video && drawn.key) return;
  const double pixels = static_cast<double>(drawn.info.width) * drawn.info.height;
  (drawn.video ? video_ : jpeg_).learn(pixels, quality, frame_bytes, text_bytes);
}

void MovingEncoding::learn_final(const Drawn& drawn, int quality, std::size_t frame_bytes) {
  const double pixels = static_cast<double>(drawn.info.width) * drawn.info.height;
  const double factor = jpeg_.factor_of(pixels, quality, frame_bytes);
  if (was_video_ && final_factor_) jpeg_.scale(factor / *final_factor_);
  final_factor_ = factor;
}

Micros MovingEncoding::calm(const protocol::View& view, const Link& link, const VideoChoice& video,
                            Micros usual) const {
  if (!video.on()) return usual;
  const double pixels = static_cast<double>(view.image.width) * view.image.height;
  const Micros key_us =
      std::min(jpeg_.time_on(link, pixels, JpegRate::quality_usual), JpegRate::moving_most_us);
  const auto rarely = static_cast<Micros>(static_cast<double>(key_us) / key_share);
  return std::clamp(rarely, usual, calm_most_us);
}

}  // namespace windsplat::session
