// How good a JPEG the link can carry while the view moves: bytes of frames in, quality and size
// out.
#pragma once

#include <cstddef>

#include "server/session/link.hpp"

namespace windsplat::session {

// Bytes of a frame with 4:2:0 chroma as head + c pixels^0.8 s(quality)^-0.47, where s is the scale
// of libjpeg's quantisation tables. The exponents were fitted to pictures of climate and tornado
// from 160x90 to 1280x720 at qualities 40 to 85 (within a third); c follows the frames sent.
class JpegRate {
 public:
  static constexpr int quality_least = 40;
  static constexpr int quality_usual = 75;           // also while the link is unknown
  static constexpr int quality_most = 85;            // where the link has plenty
  static constexpr Micros moving_most_us = 125'000;  // a moving frame's time on the link

  // A moving frame of that many pixels took so many bytes; `text_bytes` go before each frame.
  void learn(double pixels, int quality, std::size_t bytes, std::size_t text_bytes);

  [[nodiscard]] double predicted_bytes(double pixels, int quality) const;

  // For the next moving frame: the best that the link carries within `budget`, above quality_usual
  // within a quarter of it; from one call to the next it rises by one step at most.
  [[nodiscard]] int choose(double pixels, const Link& link, Micros budget);

  // The most pixels whose frame at quality_least is on the link for no longer than `budget`, or
  // moving_most_us if that is longer. Infinite while the link is unknown.
  [[nodiscard]] double pixels_max(const Link& link, Micros budget) const;

  // For the next moving frame: the least level (each halves width and height) that pixels_max asks
  // for. It stays where that changes by a quarter only, and gets finer only after a few frames.
  [[nodiscard]] int least_level(int width, int height, const Link& link, Micros budget);

 private:
  double factor_ = 0.72;  // c, before anything was sent: climate's
  double text_bytes_ = 0;
  int quality_ = quality_usual;
  int level_ = 0;
  int slack_ = 0;  // frames in a row that could have been finer
};

}  // namespace windsplat::session
