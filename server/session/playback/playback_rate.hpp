// Measures how many steps a second playback shows.
#pragma once

#include <optional>

#include "server/session/pacing/link.hpp"

namespace windsplat::session {

class PlaybackRate {
 public:
  // Playback stopped or starts anew.
  void reset() { since_.reset(); }
  // A step was shown: the steps a second, about once a second.
  std::optional<double> shown(Micros now);

 private:
  std::optional<Micros> since_;  // from the first step shown
  int steps_ = 0;                // shown since then
};

}  // namespace windsplat::session
