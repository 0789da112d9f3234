// Codec, quality and size of moving frames that the link can carry.
#pragma once

#include <cstddef>
#include <optional>

#include "protocol/view.hpp"
#include "server/quality/setting.hpp"
#include "server/session/effects.hpp"
#include "server/session/pacing/jpeg_rate.hpp"
#include "server/session/pacing/link.hpp"
#include "server/session/pacing/video_choice.hpp"

namespace windsplat::session {

// JPEG, or H.264 while VideoChoice is on; each with its own model of bytes.
class MovingEncoding {
 public:
  // For the next moving frame: chooses the codec and returns the least level of its picture. With
  // video it is at least one whose picture can be H.264, or that of JPEG.
  int least_level(const protocol::View& view, const Link& link, VideoChoice& video, Micros budget,
                  Micros now);
  // The encoding of that frame, drawn at a setting.
  Encoding choose(const protocol::View& view, const quality::Setting& setting, const Link& link,
                  const VideoChoice& video, Micros budget);

  // Records that a moving frame was sent.
  void learn(const Drawn& drawn, int quality, std::size_t frame_bytes, std::size_t text_bytes);
  // Records that a final frame was sent as JPEG. While moving frames are video, none of them tells
  // the bytes of a JPEG: these then follow the bytes of the final frames.
  void learn_final(const Drawn& drawn, int quality, std::size_t frame_bytes);

  // Least time between changes of size of moving frames, so that their key frames occupy at most
  // key_share of the time of the link; at least `usual`, at most calm_most_us.
  [[nodiscard]] Micros calm(const protocol::View& view, const Link& link, const VideoChoice& video,
                            Micros usual) const;
  static constexpr double key_share = 0.02;
  static constexpr Micros calm_most_us = 8'000'000;

  // Bytes of a JPEG.
  [[nodiscard]] double jpeg_bytes_at(double pixels, int quality) const {
    return jpeg_.predicted_bytes(pixels, quality);
  }

 private:
  JpegRate jpeg_;
  JpegRate video_{video_bytes};
  quality::PictureSize video_size_{0, 0};  // of the last frame of H.264
  bool was_video_ = false;                 // the last moving frame sent
  std::optional<double> final_factor_;     // JpegRate::factor_of the last final JPEG
};

}  // namespace windsplat::session
