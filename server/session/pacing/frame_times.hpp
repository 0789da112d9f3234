// Expected error and time of each setting for the view of a session: the forecasts of the tables,
// corrected by the times of the session's frames.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "protocol/view.hpp"
#include "server/quality/sizes.hpp"
#include "server/quality/table.hpp"
#include "server/session/effects.hpp"
#include "server/session/surroundings.hpp"

namespace windsplat::session {

// What the frames of a view are expected to cost: rendering and encoding, without waiting.
struct FrameForecast {
  quality::Forecasts settings;  // `timed`: calibrated, or a frame was measured recently
  // The final frame, including the finer slab run that measures its error.
  Micros final_us = 0;
  bool final_is_guessed = false;  // neither calibrated nor measured
  // Of the view drawn last; empty if this one has another picture size or scene.
  std::optional<quality::Halvings> halvings = std::nullopt;
};

// Before any frame of a scene was timed, its settings take at least as long as the number of its
// kernels suggests, since the forecasts of the tables know no number of samples. After that, a
// forecast's time is multiplied by the recent ratio of measured to forecast times, common to all
// settings and additionally per setting.
class FrameTimes {
 public:
  explicit FrameTimes(Forecaster forecaster, TimeByWork time_by_work = {})
      : forecaster_(std::move(forecaster)), time_by_work_(std::move(time_by_work)) {}

  [[nodiscard]] FrameForecast forecast(const protocol::View& view, Micros now) const;

  // Of the view drawn last, or, if this is another scene, without a key.
  [[nodiscard]] quality::SceneSignature signature_of(const protocol::View& view) const;

  // The view was drawn: its scene signature is known after completion during drawing, before that
  // its method only.
  void complete(const protocol::View& view, const Drawn& drawn);
  // A frame of the view at the setting took `cost`. Of a setting whose time was a guess it is
  // believed, of others as far as the frame before it confirms it. True: the first one, or earlier
  // times no longer apply, since they corrected guesses and this one a calibrated time, or vice
  // versa.
  bool learn(const quality::Setting& setting, Micros cost, const protocol::View& view, Micros now);
  void learn_final(Micros cost, const protocol::View& view, Micros now);
  void forget();  // another dataset

 private:
  struct Correction {
    double log_ratio = 0;  // relative to that of all settings
    std::optional<Micros> at;
    [[nodiscard]] bool is_recent(Micros now) const;
  };
  // Ratios of measured to forecast times.
  struct Measured {
    bool any = false;
    bool timed = false;  // against calibrated times
    double log_ratio = 0;
    double beyond = 0;  // of the last frame, over what was expected of it
    std::array<Correction, quality::settings_count> own{};
  };

  // nullopt: the view is of the scene drawn last.
  [[nodiscard]] std::optional<quality::Kind> kind_of_another(const protocol::View& view) const;
  // The least time of a final frame that was never timed, microseconds. Raises `settings` to the
  // times that the work of the view suggests if none of them is known.
  [[nodiscard]] double raise_by_work(const protocol::View& view,
                                     quality::Forecasts& settings) const;
  [[nodiscard]] quality::Forecasts uncorrected(const protocol::View& view,
                                               const std::optional<quality::Kind>& another) const;

  Forecaster forecaster_;
  TimeByWork time_by_work_;
  std::string drawn_key_;              // key of the view drawn last, before completion
  quality::SceneSignature signature_;  // known after completion
  quality::Viewpoint viewpoint_;
  std::uint64_t asked_identity_ = 0;  // of the view drawn last, before completion
  quality::Halvings halvings_{};
  quality::PictureSize drawn_size_;  // of the view
  Measured measured_;
  std::optional<double> final_factor_;  // time of the last final frame over that of its setting
};

}  // namespace windsplat::session
