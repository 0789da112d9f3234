// Quality and picture size that the link can carry during motion, for JPEG and H.264.
#pragma once

#include <cstddef>

#include "server/session/pacing/link.hpp"

namespace windsplat::session {

// Bytes of a frame with 4:2:0 chroma are head + c pixels^0.8 s(quality)^-p, where s is the scale of
// libjpeg's quantisation tables and of the quantiser of H.264; c follows the frames sent.
struct BytesModel {
  double head_bytes = 620;    // JPEG tables
  double scale_power = 0.47;  // p
  double factor = 0.72;       // c at first; that of climate
};
// Fitted to pictures of climate and tornado from 160x90 to 1280x720 at qualities 40 to 85 (within a
// third).
inline constexpr BytesModel jpeg_bytes{};
// Of frames that are not key frames: drags of climate, clouds and tornado at qualities 50 and 85
// (docs/benchmarks/links.md, Video codecs). A key frame has about the bytes of a JPEG.
inline constexpr BytesModel video_bytes{20, 0.7, 0.2};

class JpegRate {
 public:
  explicit JpegRate(const BytesModel& model = jpeg_bytes) : model_(model), factor_(model.factor) {}

  static constexpr int quality_least = 40;
  static constexpr int quality_usual = 75;           // quality also used while the link is unknown
  static constexpr int quality_most = 85;            // quality on a fast link
  static constexpr Micros moving_most_us = 125'000;  // time of a moving frame on the link

  // Records that a moving frame with that many pixels had that many bytes; `text_bytes` precede
  // each frame.
  void learn(double pixels, int quality, std::size_t bytes, std::size_t text_bytes);

  // The factor c of a frame with that many bytes.
  [[nodiscard]] double factor_of(double pixels, int quality, std::size_t bytes) const;
  // The content of frames changed so that their bytes did by that factor.
  void scale(double by) { factor_ *= by; }

  [[nodiscard]] double predicted_bytes(double pixels, int quality) const;

  // Chooses for the next moving frame the best quality within `budget`, above quality_usual within
  // a quarter of it; rises by at most one step per call.
  [[nodiscard]] int choose(double pixels, const Link& link, Micros budget);

  // Time of a frame with that many pixels on the link; 0 while the rate is unknown.
  [[nodiscard]] Micros time_on(const Link& link, double pixels, int quality) const;

  // Number of pixels whose frame at quality_least takes at most `budget`, or moving_most_us if
  // longer, on the link. Infinite while the rate is unknown.
  [[nodiscard]] double pixels_max(const Link& link, Micros budget) const;

  // Chooses for the next moving frame the least level (each halves width and height) within
  // pixels_max. Tolerates deviations of a quarter, and becomes finer only after a few frames.
  [[nodiscard]] int least_level(int width, int height, const Link& link, Micros budget);

 private:
  BytesModel model_;
  double factor_;  // c
  double text_bytes_ = 0;
  int quality_ = quality_usual;
  int level_ = 0;
  int slack_ = 0;  // consecutive frames that could have been finer
};

}  // namespace windsplat::session
