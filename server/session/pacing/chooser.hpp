// Selects the setting of moving frames: expected errors and times in, a setting out.
#pragma once

#include <cstddef>
#include <optional>

#include "protocol/view.hpp"
#include "server/quality/pick.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/table.hpp"
#include "server/session/pacing/link.hpp"

namespace windsplat::session {

// A slower setting is taken only after `slack_frames` consecutive frames that would have allowed
// it, a faster one at once, to avoid flicker. Where times are guesses the next finer resolution is
// tried, rarely if it did not fit before.
class Chooser {
 public:
  static constexpr int slack_frames = 5;
  static constexpr Micros try_after_first = 200'000;
  static constexpr Micros try_after_most = 32'000'000;

  // The first time was measured, or earlier ones no longer apply (FrameTimes::learn).
  void restart();

  // Chooses among the settings that quality::is_candidate permits and whose pictures have at most
  // `pixels_most` pixels, or all if none has.
  std::size_t choose(const protocol::View& view, const quality::Forecasts& forecasts,
                     const quality::Aim& aim, double pixels_most, Micros now);

 private:
  [[nodiscard]] bool is_wrong(std::size_t wanted, const quality::Forecasts& forecasts,
                              const quality::Aim& aim) const;
  [[nodiscard]] std::size_t patient(const quality::Choice& calm,
                                    const quality::Forecasts& forecasts, Micros now);

  bool measured_ = false;
  std::optional<std::size_t> chosen_;  // setting of the newest frame; reset after a rest
  Micros chosen_at_ = 0;
  int slack_ = 0;                     // consecutive frames that would have allowed a slower setting
  std::optional<std::size_t> tried_;  // setting tried last; empty once it did not fit
  std::optional<Micros> tried_at_;
  Micros try_after_ = try_after_first;
};

}  // namespace windsplat::session
