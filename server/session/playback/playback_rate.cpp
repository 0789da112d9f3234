#include "server/session/playback/playback_rate.hpp"

namespace windsplat::session {

std::optional<double> PlaybackRate::shown(Micros now) {
  constexpr Micros window_us = 1'000'000;
  if (!since_) {
    since_ = now;
    steps_ = 0;
    return std::nullopt;
  }
  ++steps_;
  const Micros passed = now - *since_;
  if (passed < window_us) return std::nullopt;
  const double rate = 1e6 * steps_ / static_cast<double>(passed);
  since_ = now;
  steps_ = 0;
  return rate;
}

}  // namespace windsplat::session
