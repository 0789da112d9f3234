// Whether moving frames are sent as H.264, and which of them are key frames.
#pragma once

#include <string>
#include <vector>

#include "server/session/pacing/link.hpp"

namespace windsplat::session {

// Rule. Video begins when, for a few consecutive moving frames, the whole picture as a JPEG of
// quality_low would occupy the link for longer than the budget of a frame, and ends when one of
// quality_good would occupy it for less than half the budget, for more of them. Both are of the
// view's size, whatever size is drawn: a smaller one may be the consequence of the link.
//
// The first frame of a stream is a key frame. So is the next one whenever a frame was encoded and
// not sent, since the client lacks what the encoder refers to, and after each announcement.
class VideoChoice {
 public:
  static constexpr int quality_low = 60;
  static constexpr int quality_good = 75;
  static constexpr int frames_to_begin = 3;
  static constexpr int frames_to_end = 12;
  static constexpr Micros unused_us = 10'000'000;  // after which the encoder is freed
  static constexpr Micros retry_us = 10'000'000;   // after a failure of the encoder

  // `possible`: whether this server can encode.
  explicit VideoChoice(bool possible) : possible_(possible) {}

  // The client decodes these codecs (RFC 6381); the next frame of H.264 is a key frame.
  void announced(const std::vector<std::string>& codecs);

  // For the next moving frame: `low_us` and `good_us` are the times on the link of JPEGs of the
  // view's size at the two qualities, 0 if unknown. Returns whether it is to be H.264.
  bool choose(Micros low_us, Micros good_us, Micros budget, Micros now);
  // Whether a picture of that size can be H.264 of the level announced.
  [[nodiscard]] bool fits(int width, int height) const;

  [[nodiscard]] bool on() const { return on_; }
  [[nodiscard]] bool needs_key() const { return needs_key_; }

  void started(Micros now);  // the render of a frame of H.264
  void sent();               // that frame
  void lost() { needs_key_ = true; }
  void failed(Micros now);  // the encoder: JPEG for retry_us

  // Whether an encoder that was needed is no longer so; then not again until the next start.
  [[nodiscard]] bool take_ended(Micros now);
  // Time at which take_ended() becomes true by itself; 0: not in use.
  [[nodiscard]] Micros ends_at() const { return in_use_ ? used_at_ + unused_us : 0; }

 private:
  void end();

  bool possible_;
  int macroblocks_most_ = 0;  // by the level announced; 0: no video
  bool on_ = false;
  bool needs_key_ = true;
  bool in_use_ = false;
  int count_ = 0;  // consecutive frames that argue for a change
  Micros used_at_ = 0;
  Micros not_before_ = 0;
};

}  // namespace windsplat::session
