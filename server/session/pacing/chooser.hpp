// Selects the setting of moving frames: forecasts, budget and error in, a setting out; measured
// times correct the forecasts.
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

using Micros = std::int64_t;  // microseconds of a monotonic clock

// Predict, then correct. The forecast time of a setting is multiplied by the recent ratio of
// measured to forecast times, common to all settings and additionally per setting. A slower setting
// is taken only after `slack_frames` consecutive frames that would have allowed it, a faster one at
// once, to avoid flicker. Without calibrated times the next finer resolution is tried, rarely if it
// did not fit before.
class Chooser {
 public:
  static constexpr int slack_frames = 5;
  static constexpr Micros try_after_first = 200'000;
  static constexpr Micros try_after_most = 32'000'000;

  // Records that a frame at the setting took `cost`.
  void learn(std::size_t setting, Micros cost, const quality::Forecasts& forecasts, Micros now);

  // Chooses among settings that quality::is_allowed permits for the view and whose pictures have at
  // most `pixels_most` pixels, or all if none has.
  std::size_t choose(const protocol::View& view, const quality::Forecasts& forecasts,
                     const quality::Aim& aim, double pixels_most, Micros now);

  // Expected cost of a frame at the setting.
  [[nodiscard]] Micros expected(std::size_t setting, const quality::Forecasts& forecasts,
                                Micros now) const;

  // The allowed setting with the least error among those expected to cost at most `budget`, without
  // hysteresis; nullopt if there is none.
  [[nodiscard]] std::optional<std::size_t> least_error(const protocol::View& view,
                                                       const quality::Forecasts& forecasts,
                                                       Micros budget, Micros now) const;

 private:
  struct Correction {
    double log_ratio = 0;  // relative to that of all settings
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

  double log_ratio_ = 0;  // logarithm of measured over forecast times
  bool measured_ = false;
  bool timed_ = false;  // whether log_ratio_ belongs to a calibrated scene signature
  std::array<Correction, quality::settings_count> corrections_{};
  std::optional<std::size_t> chosen_;  // setting of the newest frame; reset after a rest
  Micros chosen_at_ = 0;
  int slack_ = 0;  // consecutive frames that would have allowed a slower setting
  std::optional<Micros> tried_at_;
  Micros try_after_ = try_after_first;
};

}  // namespace windsplat::session
