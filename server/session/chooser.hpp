// Which setting a moving frame is drawn at: forecasts, a budget and an error in, a setting out;
// times measured correct what was forecast.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/view.hpp"
#include "server/quality/pick.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/table.hpp"

namespace windsplat::session {

using Micros = std::int64_t;  // microseconds of a clock that only goes forward

// Predict, then correct. A forecast's time is multiplied by what frames took lately over what was
// forecast for them: of all settings together, and beyond that of the setting itself. A slower
// setting is taken only after `slack_frames` frames in a row that would have allowed it, a faster
// one at once, so that the picture does not flicker. Times that are only guessed (nothing was
// surveyed yet) are tried with the next finer resolution, seldom where that did not fit before.
class Chooser {
 public:
  static constexpr int slack_frames = 5;
  static constexpr Micros try_after_first = 200'000;
  static constexpr Micros try_after_most = 32'000'000;

  // A frame at that setting took `cost`.
  void learn(std::size_t setting, Micros cost, const quality::Forecasts& forecasts, Micros now);

  // Of the settings that quality::is_allowed for the view, and whose pictures have at most
  // `pixels_most` pixels unless none has.
  std::size_t choose(const protocol::View& view, const quality::Forecasts& forecasts,
                     const quality::Aim& aim, double pixels_most, Micros now);

  // What a frame at that setting is expected to cost.
  [[nodiscard]] Micros expected(std::size_t setting, const quality::Forecasts& forecasts,
                                Micros now) const;

  // The allowed setting that errs least among those expected to cost at most `budget`, without
  // patience or trying; none where there is none.
  [[nodiscard]] std::optional<std::size_t> least_error(const protocol::View& view,
                                                       const quality::Forecasts& forecasts,
                                                       Micros budget, Micros now) const;

 private:
  struct Correction {
    double log_ratio = 0;  // beyond that of all settings
    Micros at = 0;
    bool known = false;
  };
  [[nodiscard]] quality::Choice best(const protocol::View& view,
                                     const quality::Forecasts& forecasts, const quality::Aim& aim,
                                     double pixels_most, Micros now) const;
  [[nodiscard]] bool is_sure(std::size_t setting, const quality::Forecasts& forecasts,
                             Micros now) const;
  [[nodiscard]] bool is_wrong(std::size_t wanted, const quality::Forecasts& forecasts,
                              const quality::Aim& aim, Micros now) const;
  [[nodiscard]] std::size_t patient(const quality::Choice& calm,
                                    const quality::Forecasts& forecasts, Micros now);

  double log_ratio_ = 0;  // of times measured over forecast
  bool measured_ = false;
  bool timed_ = false;  // log_ratio_ is of a style that was surveyed
  std::array<Correction, quality::settings_count> corrections_{};
  std::optional<std::size_t> chosen_;  // for the newest frame; forgotten after a rest
  Micros chosen_at_ = 0;
  int slack_ = 0;  // frames in a row that would have allowed a slower setting
  std::optional<Micros> tried_at_;
  Micros try_after_ = try_after_first;
};

}  // namespace windsplat::session
