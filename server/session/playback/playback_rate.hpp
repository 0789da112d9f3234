// Measures how many steps per second playback shows.
#pragma once

#include <optional>

#include "server/session/pacing/link.hpp"

namespace windsplat::session {

class PlaybackRate {
 public:
  // Call when playback stops or starts again.
  void reset() { since_.reset(); }
  // Records that a step was shown; returns the steps per second about once a second.
  std::optional<double> shown(Micros now);

 private:
  std::optional<Micros> since_;  // time of the first step shown
  int steps_ = 0;                // number of steps shown since then
};

}  // namespace windsplat::session
