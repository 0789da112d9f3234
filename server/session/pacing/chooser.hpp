// Selects the setting of moving frames: expected errors and times in, a setting out.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "protocol/view.hpp"
#include "server/quality/pick.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/sizes.hpp"
#include "server/session/pacing/frame_times.hpp"
#include "server/session/pacing/link.hpp"

namespace windsplat::session {

// While the view moves, the setting changes at most once every `calm`, by one half level, after
// `patient_frames` consecutive frames that would have changed it: pictures that change their size
// flicker. Frames that take `far_beyond` times their budget, or violate the error limit, change it
// at once. Where times are guesses the next finer resolution is tried, rarely if it did not fit
// before; one that does not fit, or a slower one that was just taken, is left at once.
class Chooser {
 public:
  static constexpr int patient_frames = 5;
  static constexpr Micros calm = 1'000'000;
  static constexpr double far_beyond = 1.4;
  static constexpr Micros try_after_first = 1'000'000;
  static constexpr Micros try_after_most = 32'000'000;

  // The first time was measured, or earlier ones no longer apply (FrameTimes::learn).
  void restart();
  // Other limits: the next choice is independent of the earlier ones.
  void forget() { chosen_.reset(); }

  // What the link permits.
  struct Limits {
    double pixels_most = std::numeric_limits<double>::infinity();
    // Between changes, not less than Chooser::calm. A longer one is for small improvements only,
    // and a large one is then made in one change.
    Micros calm = Chooser::calm;
  };
  // Chooses among the settings that quality::is_candidate permits and whose pictures have at most
  // `pixels_most` pixels, or all if none has. `may_try` is asked
  // directly before a guessed time is tried.
  quality::Setting choose(const protocol::View& view, const FrameForecast& forecast,
                          const quality::Aim& aim, const Limits& limits,
                          const std::function<bool()>& may_try, Micros now);

 private:
  // What one choice is made from.
  struct Case {
    const protocol::View& view;
    std::vector<quality::Option> options;
    const quality::Aim& aim;
    double pixels_most;
    Micros calm;
    const std::function<bool()>& may_try;
    Micros now;
  };
  [[nodiscard]] const quality::Option* current(const Case& one) const;
  [[nodiscard]] bool is_wrong(const quality::Option& here, const quality::Choice& wanted,
                              const Case& one) const;
  [[nodiscard]] bool is_a_try(Micros now) const;
  void go(const quality::Setting& setting, Micros now);
  void step(const quality::Option& here, const Case& one);
  void try_finer(const quality::Option& here, const Case& one);

  quality::Sizes sizes_;
  bool measured_ = false;
  std::optional<quality::Setting> chosen_;  // setting of the newest frame; reset after a rest
  Micros chosen_at_ = 0;
  Micros changed_at_ = 0;
  std::optional<Micros> slower_since_;     // when it was chosen, if it was expected to fit
  int impatience_ = 0;                     // consecutive frames that would have changed the setting
  std::optional<quality::Setting> tried_;  // setting tried last; empty once it did not fit
  std::optional<Micros> tried_at_;
  Micros try_after_ = try_after_first;
};

}  // namespace windsplat::session
